// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "flags.h"

#include "errors.h"
#include "option_list.h"

#include <d2s1r/version.h>

#include <charconv>
#include <cmath>

namespace d2s1r::app
{
namespace
{
constexpr const char* kUsage =
    "Usage: rawlog-localize -m MAP -i IN.rawlog -o OUT_DIR [OPTION]...\n"
    "       rawlog-localize --write-config FILE [-c CONFIG.ini]\n"
    "Localize every 2D laser scan of an MRPT rawlog in a known map, each scan on its own, without a\n"
    "first guess.\n\n";

constexpr const char* kOutputs =
    "\nMAP is a .simplemap(.gz), a .gridmap(.gz), a ROS map_server .yaml, an image (with --resolution), or\n"
    "a file with a serialized CMultiMetricMap or CSignatureMap2D.\n\n"
    "OUT_DIR receives frames.csv, hypotheses.csv, trajectory.tum, trajectory.txt, localized.rawlog,\n"
    "summary.json, map.png and scene.3Dscene; with --fuse also fused.csv and fused.tum.\n\n"
    "Exit status: 0 done, 1 wrong use or configuration, 2 an input that cannot be read or used, 3 an\n"
    "output that cannot be written, 130 interrupted (finished frames are on disk).\n";

[[noreturn]] void wrong(const std::string& flag, const std::string& what)
{
	throw UserError(kWrongUse, flag, what + "; see rawlog-localize --help");
}

template <class Number>
Number parse_number(const std::string& flag, const std::string& text)
{
	Number number{};
	const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
	if (error != std::errc() || end != text.data() + text.size() || text.empty())
		wrong(flag, "'" + text + "' is not a number that can stand here");
	return number;
}

void parse_frames(const std::string& text, Flags& flags)
{
	const auto colon = text.find(':');
	if (colon == std::string::npos) wrong("--frames", "'" + text + "' is not a range; write A:B, A: or :B");
	const std::string first = text.substr(0, colon), past = text.substr(colon + 1);
	if (!first.empty()) flags.first_frame = parse_number<std::size_t>("--frames", first);
	if (!past.empty()) flags.past_frame = parse_number<std::size_t>("--frames", past);
	if (flags.first_frame >= flags.past_frame) wrong("--frames", "'" + text + "' holds no frame; A must be below B");
}

std::optional<ImageGeometry> parse_image(const std::string& resolution, const std::string& origin)
{
	if (resolution.empty() && !origin.empty()) wrong("--origin", "only goes with --resolution");
	if (resolution.empty()) return std::nullopt;
	ImageGeometry image;
	image.resolution = parse_number<double>("--resolution", resolution);
	if (!(image.resolution > 0) || !std::isfinite(image.resolution)) wrong("--resolution", "must be above 0 m");
	if (origin.empty()) return image;
	const auto comma = origin.find(',');
	if (comma == std::string::npos) wrong("--origin", "'" + origin + "' is not a point; write X,Y in m");
	image.origin_x = parse_number<double>("--origin", origin.substr(0, comma));
	image.origin_y = parse_number<double>("--origin", origin.substr(comma + 1));
	return image;
}

void check_complete(const Flags& flags)
{
	if (flags.only_writes_config() && !flags.write_config.empty()) return;
	if (flags.map.empty()) wrong("--map", "missing; name the map file");
	if (flags.rawlog.empty()) wrong("--input", "missing; name the rawlog file");
	if (flags.output_dir.empty()) wrong("--output", "missing; name the folder to write to");
}
/// All options; the order is that of --help.
struct Options
{
	using Value = TCLAP::ValueArg<std::string>;
	using Switch = TCLAP::SwitchArg;

	OptionList list;
	Value& map = list.value("m", "map", "MAP", "map to localize in");
	Value& rawlog = list.value("i", "input", "IN.rawlog", "rawlog with 2D laser scans");
	Value& output = list.value("o", "output", "OUT_DIR", "folder for the results, made if missing");
	Value& config = list.value("c", "config", "CONFIG.ini", "parameters; those not in the file keep their defaults");
	Value& truth = list.value(
	    "", "ground-truth", "GT.txt",
	    "true poses, 'time x y phi' or 'time x y z yaw pitch roll' a line: adds accuracy to the results");
	Value& label = list.value("", "sensor-label", "LABEL", "laser to use; default: the one with most scans");
	Value& frames = list.value("", "frames", "A:B", "localize scan frames A to B-1 only, counted from 0");
	Value& threads = list.value(
	    "", "threads", "N",
	    "threads to build the index and to localize with; the results do not depend on it (default 1)");
	Value& seed = list.value("", "seed", "N", "seed of whatever draws random numbers (default 1)");
	Value& plugins = list.value("", "plugins", "A.so,B.so", "MRPT modules to load first");
	Switch& fuse = list.flag(
	    "", "fuse", "also run a particle filter, seeded and watched by the results; needs the pf-init plug-in");
	Value& motion = list.value(
	    "", "motion", "SOURCE",
	    "what moves the filter: 'pseudo' (successive results), 'odometry' (of the rawlog) or 'both' (default)");
	Value& save_map = list.value("", "save-map", "FILE", "save the map and its parameters as a CSignatureMap2D");
	Value& write_config =
	    list.value("", "write-config", "FILE", "write all parameters, with units and meanings, as an ini file");
	Value& write_pf_ini = list.value(
	    "", "write-pf-ini", "FILE.ini",
	    "write what MRPT's pf-localization needs to go on from the results: this ini, FILE.rawlog and FILE.gridmap.gz");
	Value& resolution = list.value("", "resolution", "R", "of a map that is an image [m/pixel]");
	Value& origin = list.value(
	    "", "origin", "X,Y", "where the lower left corner of such an image is in the map frame [m] (default 0,0)");
	Switch& quiet = list.flag("q", "quiet", "print errors only");
	Switch& version = list.flag("", "version", "print the version and exit");
	Switch& help = list.flag("h", "help", "print this help and exit");
};

int parse_threads(const std::string& text)
{
	const int threads = parse_number<int>("--threads", text);
	if (threads < 1 || threads > 256) wrong("--threads", "must be 1 to 256");
	return threads;
}

MotionSource parse_motion(const std::string& text, bool fuse)
{
	if (!fuse) wrong("--motion", "only goes with --fuse");
	if (text == "pseudo") return MotionSource::kPseudo;
	if (text == "odometry") return MotionSource::kOdometry;
	if (text != "both") wrong("--motion", "'" + text + "' is not one of pseudo, odometry, both");
	return MotionSource::kBoth;
}

Flags flags_of(Options& options)
{
	Flags flags;
	flags.map = options.map.getValue();
	flags.rawlog = options.rawlog.getValue();
	flags.output_dir = options.output.getValue();
	flags.config = options.config.getValue();
	flags.ground_truth = options.truth.getValue();
	flags.plugins = options.plugins.getValue();
	flags.save_map = options.save_map.getValue();
	flags.write_config = options.write_config.getValue();
	flags.write_pf_ini = options.write_pf_ini.getValue();
	if (options.label.isSet()) flags.sensor_label = options.label.getValue();
	if (options.frames.isSet()) parse_frames(options.frames.getValue(), flags);
	if (options.threads.isSet()) flags.threads = parse_threads(options.threads.getValue());
	if (options.seed.isSet()) flags.seed = parse_number<std::uint32_t>("--seed", options.seed.getValue());
	flags.image = parse_image(options.resolution.getValue(), options.origin.getValue());
	flags.fuse = options.fuse.getValue();
	if (options.motion.isSet()) flags.motion = parse_motion(options.motion.getValue(), flags.fuse);
	flags.quiet = options.quiet.getValue();
	return flags;
}
}  // namespace

std::optional<Flags> parse_flags(int argc, char** argv, std::ostream& out)
{
	Options options;
	options.list.parse(argc, argv);
	if (options.help.getValue())
	{
		out << kUsage;
		options.list.print(out);
		out << kOutputs;
		return std::nullopt;
	}
	if (options.version.getValue())
	{
		out << "rawlog-localize (d2s1r) " D2S1R_VERSION "\n";
		return std::nullopt;
	}
	const Flags flags = flags_of(options);
	check_complete(flags);
	return flags;
}
}  // namespace d2s1r::app
