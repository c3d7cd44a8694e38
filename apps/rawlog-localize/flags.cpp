// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "flags.h"

#include "errors.h"
#include "flag_values.h"
#include "option_list.h"

#include <d2s1r/version.h>

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

void check_complete(const Flags& flags)
{
	if (flags.only_writes_config() && !flags.write_config.empty()) return;
	if (flags.map.empty()) wrong("--map", "missing; name the map file");
	if (flags.rawlog.empty()) wrong("--input", "missing; name the rawlog file");
	if (flags.output_dir.empty()) wrong("--output", "missing; name the folder to write to");
}

/// Maps are read by the ends of their names.
void check_saved_map(const std::string& file)
{
	if (is_image_name(file) || is_yaml_name(file))
		wrong("--save-map", "'" + file + "' would be read back as an image or yaml; name it FILE.signaturemap");
}

/// An image needs a resolution; no other map takes one.
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
	    "judge the last N scans together, linked by the odometry of the rawlog or, without it, by the motion that the "
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
