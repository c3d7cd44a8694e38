// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "cli/flags.h"

#include "cli/errors.h"
#include "cli/option_list.h"

#include <d2s1r/version.h>
#include <mrpt/core/format.h>

#include <charconv>
#include <cmath>
#include <limits>

namespace d2s1r::app
{
namespace
{
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
	{
		using Limits = std::numeric_limits<Number>;
		std::string expected = "a number";
		if constexpr (std::is_integral_v<Number>)
			expected = "a whole number from " + std::to_string(Limits::min()) + " to " + std::to_string(Limits::max());
		wrong(flag, "'" + text + "' is not " + expected);
	}
	return number;
}

/// Parses finite numbers with commas between them.
std::vector<double> parse_numbers(const std::string& flag, const std::string& text)
{
	std::vector<double> numbers;
	for (std::size_t start = 0; start <= text.size();)
	{
		const auto end = std::min(text.find(',', start), text.size());
		numbers.push_back(parse_number<double>(flag, text.substr(start, end - start)));
		if (!std::isfinite(numbers.back())) wrong(flag, "'" + text + "' is not finite");
		start = end + 1;
	}
	return numbers;
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

int parse_threads(const std::string& text)
{
	const int threads = parse_number<int>("--threads", text);
	if (threads < 1 || threads > 256) wrong("--threads", "must be 1 to 256");
	return threads;
}

std::uint32_t parse_seed(const std::string& text)
{
	return parse_number<std::uint32_t>("--seed", text);
}

std::optional<int> parse_window(const std::string& text)
{
	const int frames = parse_number<int>("--window", text);
	if (frames < 1 || frames > 1000) wrong("--window", "must be 1 to 1000 frames");
	return frames > 1 ? std::optional(frames) : std::nullopt;  // one scan has no others to be used with
}

Prior parse_region(const std::string& text)
{
	const auto corners = parse_numbers("--region", text);
	if (corners.size() != 4) wrong("--region", "'" + text + "' is not a box; write X0,Y0,X1,Y1 in m");
	if (corners[0] == corners[2] || corners[1] == corners[3])
		wrong("--region", "'" + text + "' is an empty box; give two opposite corners");
	return make_prior(corners[0], corners[1], corners[2], corners[3]);
}

double parse_time_budget(const std::string& text)
{
	const auto budget = parse_number<double>("--time-budget", text);
	if (!(budget > 0) || !std::isfinite(budget)) wrong("--time-budget", "must be above 0 ms");
	return budget;
}

MotionSource parse_motion(const std::string& text, bool fuse)
{
	if (!fuse) wrong("--motion", "only goes with --fuse");
	if (text == "pseudo") return MotionSource::kPseudo;
	if (text == "odometry") return MotionSource::kOdometry;
	if (text != "both") wrong("--motion", "'" + text + "' is not one of pseudo, odometry, both");
	return MotionSource::kBoth;
}

std::optional<ImageGeometry> parse_image(const std::string& resolution, const std::string& origin)
{
	if (resolution.empty() && !origin.empty()) wrong("--origin", "only goes with --resolution");
	if (resolution.empty()) return std::nullopt;
	ImageGeometry image;
	image.resolution = parse_number<double>("--resolution", resolution);
	constexpr double kLeast = ImageGeometry::kLeastResolution, kGreatest = ImageGeometry::kGreatestResolution;
	if (!(image.resolution >= kLeast && image.resolution <= kGreatest))
		wrong("--resolution", mrpt::format("must be %g to %g m a pixel", kLeast, kGreatest));
	if (origin.empty()) return image;
	const auto point = parse_numbers("--origin", origin);
	if (point.size() != 2) wrong("--origin", "'" + origin + "' is not a point; write X,Y in m");
	image.origin_x = point[0];
	image.origin_y = point[1];
	return image;
}

constexpr const char* kUsage =
    "Usage: rawlog-localize -m MAP -i IN.rawlog -o OUT_DIR [OPTION]...\n"
    "       rawlog-localize --write-config FILE [-c CONFIG.ini]\n"
    "Localize every 2D laser scan of an MRPT rawlog in a known map, each scan on its own, without an\n"
    "initial pose.\n\n";

constexpr const char* kOutputs =
    "\nMAP is a .simplemap(.gz), a .gridmap(.gz), a ROS map_server .yaml, an image (with --resolution), or\n"
    "a file with a serialized CMultiMetricMap or CSignatureMap2D.\n\n"
    "OUT_DIR receives frames.csv, hypotheses.csv, trajectory.tum, trajectory.txt, localized.rawlog,\n"
    "summary.json, map.png and scene.3Dscene; with --fuse also fused.csv and fused.tum.\n\n"
    "Exit status: 0 done, 1 wrong use or configuration, 2 an input that cannot be read or used, 3 an\n"
    "output that cannot be written, 130 interrupted (finished frames are on disk).\n";

void check_complete(const Flags& flags)
{
	if (flags.only_writes_config() && !flags.write_config.empty()) return;
	if (flags.map.empty()) wrong("--map", "missing; name the map file");
	if (flags.rawlog.empty()) wrong("--input", "missing; name the rawlog file");
	if (flags.output_dir.empty()) wrong("--output", "missing; name the folder to write to");
}

/// Refuses names that load_map() would take for another kind of map.
void check_saved_map(const std::string& file)
{
	if (is_image_name(file) || is_yaml_name(file))
		wrong("--save-map", "'" + file + "' would be read back as an image or yaml; name it FILE.signaturemap");
}

/// Checks that an image has a resolution, and that no other map has one.
void check_image(const Flags& flags)
{
	if (is_image_name(flags.map) == flags.image.has_value()) return;
	if (!flags.image)
		throw UserError(
		    kBadInput, flags.map, "an image does not say its resolution; give it with --resolution [m/pixel]");
	std::string known;
	for (const char* extension : kImageExtensions) known += std::string(known.empty() ? "" : ", ") + extension;
	wrong("--resolution", "only goes with an image (" + known + "); leave it out or rename the image");
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
	    "true poses, one per line, 'time x y phi' or 'time x y z yaw pitch roll': adds accuracy to the results");
	Value& label = list.value("", "sensor-label", "LABEL", "laser to use; default: the one with the most scans");
	Value& frames =
	    list.value("", "frames", "A:B", "localize scan frames A to B-1 only, counted from 0; either may be left out");
	Value& threads = list.value(
	    "", "threads", "N",
	    "number of threads to localize with, and to build the index of method = paper; the results do not depend on it "
	    "(default 1)");
	Value& window = list.value(
	    "", "window", "N",
	    "use the last N scans jointly, linked by the odometry of the rawlog or, without it, by the motion that the "
	    "results agree on; finds the place in buildings that look alike all over (default: every scan on its own)");
	Value& region = list.value(
	    "", "region", "X0,Y0,X1,Y1",
	    "the robot is in the box between these two corners [m], map frame: search there only");
	Value& time_budget = list.value(
	    "", "time-budget", "MS",
	    "time for each scan [ms], not counting --window and --fuse: a search for candidates always runs to its "
	    "end, then as many of them are refined as there is time for; the results depend on the machine and its load "
	    "(default: no limit)");
	Value& seed = list.value("", "seed", "N", "seed of the particle filter, from 0 to 4294967295 (default 1)");
	Value& plugins = list.value("", "plugins", "A.so,B.so", "MRPT modules to load first");
	Switch& fuse = list.flag(
	    "", "fuse",
	    "also run a particle filter, seeded from the results and checked against them; needs the pf-init plug-in");
	Value& motion = list.value(
	    "", "motion", "SOURCE",
	    "what moves the filter: 'pseudo' (successive results), 'odometry' (of the rawlog) or 'both' (default)");
	Value& save_map = list.value(
	    "", "save-map", "FILE",
	    "save the map and its parameters as a CSignatureMap2D, for MRPT programs; if FILE is later given as MAP, its "
	    "grid is used, its parameters are not");
	Value& write_config =
	    list.value("", "write-config", "FILE", "write all parameters, with units and meanings, as an ini file");
	Value& write_pf_ini = list.value(
	    "", "write-pf-ini", "FILE.ini",
	    "write files for MRPT's pf-localization: this ini (it starts at the first localized pose), FILE.rawlog (the "
	    "localized frames, with pseudo-odometry between them) and FILE.gridmap.gz");
	Value& resolution = list.value("", "resolution", "R", "of a map that is an image [m/pixel]");
	Value& origin = list.value(
	    "", "origin", "X,Y", "where the lower left corner of such an image is in the map frame [m] (default 0,0)");
	Switch& quiet = list.flag("q", "quiet", "print errors only");
	Switch& version = list.flag("", "version", "print the version and exit");
	Switch& help = list.flag("h", "help", "print this help and exit");
};

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
	if (options.window.isSet()) flags.window = parse_window(options.window.getValue());
	if (options.region.isSet()) flags.query.prior = parse_region(options.region.getValue());
	if (options.time_budget.isSet()) flags.query.time_budget = parse_time_budget(options.time_budget.getValue());
	if (options.seed.isSet()) flags.seed = parse_seed(options.seed.getValue());
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
	options.list.refuse_empty_values(options.label);  // a laser's label may be empty
	const Flags flags = flags_of(options);
	check_complete(flags);
	check_saved_map(flags.save_map);
	if (!flags.only_writes_config()) check_image(flags);
	return flags;
}
}  // namespace d2s1r::app
