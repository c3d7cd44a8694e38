// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "cli/command_line.h"

#include <CLI/CLI.hpp>
#include <d2s1r/simd_targets.h>
#include <d2s1r/version.h>
#include <shell/errors.h>
#include <shell/options.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "cli/values.h"

namespace d2s1r::app
{
namespace
{
const Usage kUsage = {
    "rawlog-localize",
    "Usage: rawlog-localize -m MAP -i LOG -o OUT_DIR [OPTION]...\n"
    "       rawlog-localize -m MAP -i LOG --stream [OPTION]...\n"
    "       rawlog-localize -m MAP -i LOG --diagnose [OPTION]...\n"
    "       rawlog-localize -m MAP -i LOG --calibrate [OPTION]...\n"
    "       rawlog-localize --write-config FILE [-c CONFIG.ini]\n"
    "Localize every 2D laser scan of a log in a known map, each scan on its own, without an initial pose.\n\n",
    "LOG is a ROS 2 bag (a folder, or a file of sqlite3 or MCAP), a ROS 1 bag, an MRPT rawlog or a CARMEN\n"
    "log. The program recognizes the format by the content.\n\n"
    "MAP is a .simplemap(.gz), a .gridmap(.gz), a ROS map_server .yaml, an image (with --resolution), or\n"
    "a file with a serialized CMultiMetricMap or CSignatureMap2D. An atlas is a folder of such maps or a\n"
    "yaml file: maps: {NAME: {file: MAP, floor: TEXT, region: [X0, Y0, X1, Y1], config: CONFIG.ini}, ...};\n"
    "only 'file' is required. The column 'map' of the results names the map.\n\n"
    "The program writes frames.csv, hypotheses.csv, trajectory.tum, trajectory.txt, localized.rawlog,\n"
    "run.json, summary.json, map.png, scene.3Dscene and report.html to OUT_DIR; with --track also\n"
    "track.csv and track.tum; with --fuse also fused.csv and fused.tum; with --check also check.csv.\n\n"
    "Examples:\n"
    "  rawlog-localize -m office.yaml -i my_bag -o results\n"
    "  rawlog-localize -m office.yaml -i drive.rawlog -o results --window 10\n\n"
    "Exit status: 0 done, 1 wrong use or configuration, 2 an input cannot be read or used, 3 an output\n"
    "cannot be written, 130 interrupted (the finished frames are on disk).",
    "; write -m MAP -i LOG -o OUT_DIR",
    {{"--bag", "--input"}, {"--log", "--input"}, {"--rawlog", "--input"}, {"--parameters", "--config"}}};

[[noreturn]] void wrong(const std::string& option, const std::string& what)
{
	refuse_option(kUsage.program, option, what);
}

/// Options that are understood together with another one.
struct Dependent
{
	std::optional<double> resolution;            //!< [m/pixel]
	std::optional<mrpt::math::TPoint2D> origin;  //!< [m]
	std::optional<MotionSource> motion;
	std::optional<WatchSettings> watch;
	std::string topic;
	bool no_rawlog = false;
	std::string calibration;
};

void add_inputs(OptionGroup input, CommandLine& command, Dependent& dependent)
{
	LogRequest& log = command.log;
	input.values(
	    "-m,--map", "MAP",
	    "the map to localize in, or an atlas of maps: a yaml file that lists them, a folder of maps, or this option "
	    "given several times",
	    command.map.files);
	input.value(
	    "-i,--input", "LOG",
	    "the log with 2D laser scans: a ROS bag, a rawlog or a CARMEN log; - reads a rawlog from standard input while "
	    "it is written",
	    log.file);
	input.value(
	    "--frames", "A:B:STEP",
	    "localize only the scans A, A + STEP, A + 2 STEP, ... before B, counted from 0; you may leave out A, B and "
	    ":STEP",
	    [&](const std::string& text) { log.frames = parse_frames(text); });
	input.value(
	    "-c,--config", "CONFIG.ini", "read parameters from this file; those not in the file keep their defaults",
	    command.search.config);
	input.values(
	    "--set", "SECTION.KEY=VALUE",
	    "set a parameter, which wins over --config; may be given several times, as in --set scan.no_return=1",
	    command.search.settings);
	input.value(
	    "--ground-truth", "GT.txt",
	    "compare the results with these true poses. Each line is 'time x y phi', 'time x y z yaw pitch roll' or a line "
	    "of TUM; the file may also be CSV with named columns; topic:/TOPIC reads poses or odometry from the log "
	    "instead, and tf:FRAME the robot's pose in a frame of its transforms, such as tf:map",
	    log.ground_truth);
	input.value(
	    "--check", "POSES",
	    "judge the poses that a tracker published while the log was recorded, in the formats of --ground-truth: each "
	    "scan says that the tracker fits, that it is lost, or that the scan cannot tell",
	    log.check);
	input.value(
	    "--watch", "N,METRES",
	    "call a tracker lost after N localized scans in a row that are more than METRES away from it (default 4,0.4)",
	    [&](const std::string& text) { dependent.watch = parse_watch(text); });
	input.value(
	    "--resolution", "R", "the resolution of a map that is an image [m/pixel]",
	    [&](const std::string& text) { dependent.resolution = parse_resolution(text); });
	input.value(
	    "--origin", "X,Y", "the position of the lower left corner of such an image in the map frame [m] (default 0,0)",
	    [&](const std::string& text) { dependent.origin = parse_point(text); });
	input.value(
	    "--index", "FILE",
	    "keep the index of the map in FILE, so that the next run starts in a fraction of the time. The index is built "
	    "and saved again if FILE is missing or damaged, or if the map, the parameters or the version differ. With an "
	    "atlas, FILE is a folder that holds a file for each map",
	    command.map.index);
	input.value("--plugins", "A.so,B.so", "load these MRPT modules first", command.search.plugins);
}

void add_laser(OptionGroup laser, LogRequest& log, Dependent& dependent)
{
	laser.text(
	    "--sensor-label", "LABEL", "use the laser with this label (default: the laser with the most scans)",
	    [&](const std::string& text) { log.label = text; });  // a laser's label may be empty
	laser.value("--topic", "TOPIC", "use the laser of this ROS topic; the same as --sensor-label", dependent.topic);
	laser.flag(
	    "--merge-lasers",
	    "use all lasers together: each scan of the chosen laser with the last scan of each other laser, at most 0.5 s "
	    "older, linked by the odometry if there is any",
	    log.merge_lasers);
	laser.value(
	    "--sensor-pose", "X,Y,Z,YAW,PITCH,ROLL",
	    "the pose of the laser on the robot [m, deg], in place of what the log says; a roll of 180 means upside down",
	    [&](const std::string& text) { ros::enter("sensor-pose", text, log.overrides); });
	laser.value(
	    "--max-range", "M", "the range up to which the laser sees [m], in place of what the log says",
	    [&](const std::string& text) { ros::enter("max-range", text, log.overrides); });
	laser.value(
	    "--range-factor", "F", "multiply all ranges of the laser by F, for example by 0.001 if the log has them in mm",
	    [&](const std::string& text) { ros::enter("range-factor", text, log.overrides); });
	laser.flag(
	    "--ignore-flags",
	    "use the readings that the log flags as invalid, if they are above 0 and below the laser's range",
	    log.overrides.ignores_flags);
	laser.value(
	    "--cloud-height", "A:B",
	    "also use the PointCloud2 messages of a ROS recording: their points between A and B above the origin of the "
	    "robot's frame [m] make a scan. Choose a band in which walls stand and the floor does not",
	    [&](const std::string& text) { log.cloud_height = parse_height_band(text); });
	laser.value(
	    "--beam-angles", "FIRST,LAST",
	    "the angles of the first and the last beam of a scan in the frame of the laser [deg], counter-clockwise, in "
	    "place of what the log says; LAST is below FIRST if the laser turns clockwise",
	    [&](const std::string& text) { ros::enter("beam-angles", text, log.overrides); });
	laser.value(
	    "--sweep-time", "S[,FIRST]",
	    "the time from the first beam of a scan to the last [s], negative if the laser took the last beam first, and "
	    "the delay of the first beam after the scan's time [s] (default 0), in place of what the log says; the program "
	    "moves all beams to the time of the scan",
	    [&](const std::string& text) { ros::enter("sweep-time", text, log.overrides); });
	laser.value(
	    "--min-range", "M", "leave out readings below M [m], such as those of the robot's own body",
	    [&](const std::string& text) { ros::enter("min-range", text, log.overrides); });
	laser.flag("--mirrored-odometry", "take the odometry's left for right", log.overrides.is_odometry_mirrored);
	laser.value(
	    "--odometry-clock", "S", "how far the clock of the odometry is ahead of that of the scans [s]",
	    [&](const std::string& text) { ros::enter("odometry-clock", text, log.overrides); });
	laser.value(
	    "--calibration", "FILE", "read the options of this group from FILE, which --calibrate wrote",
	    [&](const std::string& text) { dependent.calibration = text; });
	laser.flag(
	    "--as-told",
	    "believe what the log says of the laser and the odometry, even if the drive through the map contradicts it",
	    log.is_as_told);
}

void add_search(OptionGroup search, SearchRequest& request, Dependent& dependent)
{
	search.value(
	    "--threads", "N",
	    "use N threads to localize, and to build the index of method = paper; the results are the same for any number "
	    "(default 1)",
	    [&](const std::string& text) { request.threads = static_cast<int>(parse_whole_number(text, 1, 256)); });
	search.value(
	    "--window", "N",
	    "use the last N scans jointly, linked by the odometry of the log or, without it, by the motion that their "
	    "results agree on. This finds the place in buildings with many places that look alike (default: each scan by "
	    "itself)",
	    [&](const std::string& text) { request.window = parse_window(text); });
	search.value(
	    "--region", "X0,Y0,X1,Y1", "search only in the box between these two corners [m], map frame",
	    [&](const std::string& text) { request.query.prior = parse_region(text); });
	search.value(
	    "--time-budget", "MS",
	    "limit the time for each scan [ms]; the time of --window, --track and --fuse is not counted. The search for "
	    "candidates "
	    "always runs to its end, then as many candidates are refined as fit into the time. A pose is ambiguous if a "
	    "candidate that was "
	    "left out may be the right one. The results depend on the machine and its load (default: no limit)",
	    [&](const std::string& text) { request.query.time_budget = parse_time_budget(text); });
	search.flag(
	    "--track",
	    "also follow the robot from scan to scan by a Tracker, which finds it by itself and needs no other tracker",
	    request.track);
	search.flag(
	    "--fuse",
	    "also run a particle filter that is seeded from the results and checked against them; this needs the pf-init "
	    "plug-in",
	    request.fuse);
	search.value(
	    "--motion", "SOURCE",
	    "what moves the filter: 'pseudo' (successive results), 'odometry' (of the log) or 'both' (default)",
	    [&](const std::string& text) { dependent.motion = parse_motion(text); });
	search.value(
	    "--seed", "N", "the seed of the filter's random numbers, from 0 to 4294967295 (default 1)",
	    [&](const std::string& text)
	    { request.seed = static_cast<std::uint32_t>(parse_whole_number(text, 0, 4294967295)); });
}

void add_outputs(OptionGroup output, OutputRequest& request, Dependent& dependent)
{
	output.value(
	    "-o,--output", "OUT_DIR", "write the results to this folder; it is made if it is missing", request.folder);
	output.flag("--no-rawlog", "do not write localized.rawlog, which is as large as the log", dependent.no_rawlog);
	output.value(
	    "--save-map", "FILE",
	    "save the map and its parameters as a CSignatureMap2D for MRPT programs; if you later give FILE as MAP, its "
	    "grid is used, but its parameters are not",
	    request.save_map);
	output.value(
	    "--write-config", "FILE", "write all parameters, with units and meanings, to an ini file",
	    request.write_config);
	output.value(
	    "--write-pf-ini", "FILE.ini",
	    "write files for MRPT's pf-localization: FILE.ini, which makes it start at the first localized pose, "
	    "FILE.rawlog with the localized frames and the pseudo-odometry between them, and FILE.gridmap.gz",
	    request.write_pf_ini);
	output.flag(
	    "--diagnose",
	    "find out why scans do not match the map, and write nothing: try the usual mistakes on 20 scans (resolution of "
	    "the map, mirrored scans, unit of the ranges, ...), and report which mistake explains them and which option "
	    "corrects it. A run in which most frames are not localized does this at its end",
	    request.diagnose);
	output.flag(
	    "--calibrate",
	    "print what the drive through the map shows of the laser (where it is on the robot, when its beams are taken, "
	    "how its angles and ranges are scaled) and of the odometry, and write it to calibration.yaml in OUT_DIR or "
	    "here; "
	    "localize nothing",
	    request.calibrate);
	output.flag("-q,--quiet", "print errors only", request.quiet);
}

void add_live(OptionGroup live, CommandLine& command)
{
	live.flag(
	    "--follow",
	    "read a rawlog that grows: wait for more at its end, until the file is removed or truncated, or the run is "
	    "interrupted",
	    command.log.follow);
	live.flag(
	    "--stream",
	    "print a line of JSON for each frame as soon as it is localized, instead of the table; you may then leave out "
	    "-o",
	    command.output.stream);
}

void check_complete(const CommandLine& command)
{
	if (command.map.files.empty()) wrong("--map", "missing; name the map file");
	if (command.log.file.empty()) wrong("--input", "missing; name the log");
	if (command.output.folder.empty() && !command.output.stream && !command.output.diagnose &&
	    !command.output.calibrate)
		wrong("--output", "missing; name the folder to write to");
}

void check_live(const LogRequest& log, const OutputRequest& output)
{
	if (log.follow && log.file == logs::kStandardInput)
		wrong("--follow", "is for a file that grows; standard input is read to its end without it");
	if (output.diagnose && log.is_live())
		wrong("--diagnose", "reads the log several times, which it cannot while the log is written; record it first");
	if (output.calibrate && log.is_live())
		wrong("--calibrate", "reads the whole log first, which it cannot while the log is written; record it first");
	for (const auto& [option, name] : {std::pair("--ground-truth", log.ground_truth), {"--check", log.check}})
		if (name.rfind(kTopicPrefix, 0) == 0 && log.is_live())
			wrong(option, "'" + name + "' is of a recording of ROS, but a live log is a rawlog; name a file of poses");
}

void check_without_folder(const CommandLine& command)
{
	if (!command.output.folder.empty()) return;
	for (const auto& [option, value] :
	     {std::pair("--ground-truth", command.log.ground_truth),
	      {"--save-map", command.output.save_map},
	      {"--write-pf-ini", command.output.write_pf_ini},
	      {"--write-config", command.output.write_config}})
		if (!value.empty()) wrong(option, "goes with files; name a folder for them with --output");
}

/// Refuses names that load_map() would take for another kind of map.
void check_saved_map(const std::string& file)
{
	if (is_image_name(file) || is_yaml_name(file))
		wrong("--save-map", "'" + file + "' would be read back as an image or yaml; name it FILE.signaturemap");
}

void check_image(const MapRequest& map)
{
	if (is_image_name(map.name()) == map.image.has_value()) return;
	if (!map.image)
		throw UserError(
		    kBadInput, map.name(), "an image does not say its resolution; give it with --resolution [m/pixel]");
	std::string known;
	for (const char* extension : kImageExtensions) known += std::string(known.empty() ? "" : ", ") + extension;
	wrong("--resolution", "only goes with an image (" + known + "); leave it out or rename the image");
}

/// Enters the options that are understood together with another one. \throws UserError (kWrongUse) if that is missing
void add_dependent(CommandLine& command, const Dependent& dependent)
{
	if (!dependent.topic.empty())
	{
		if (command.log.label) wrong("--topic", "is the same as --sensor-label; leave one of them out");
		command.log.label = dependent.topic;
		command.log.label_option = "--topic";
	}
	if (dependent.motion && !command.search.fuse) wrong("--motion", "only goes with --fuse");
	command.search.motion = dependent.motion.value_or(command.search.motion);
	if (!dependent.calibration.empty()) read_calibration(dependent.calibration, command.log.overrides);
	if (command.output.calibrate && command.output.diagnose)
		wrong("--calibrate", "and --diagnose are two questions; leave one out");
	if (command.output.calibrate && command.log.is_as_told)
		wrong("--calibrate", "asks what --as-told does not want to know; leave one out");
	if (!command.log.check.empty() && command.output.diagnose)
		wrong("--check", "judges a tracker while frames are localized, which --diagnose does not; leave one out");
	if (dependent.watch && command.log.check.empty()) wrong("--watch", "only goes with --check");
	command.log.watch = dependent.watch.value_or(command.log.watch);
	if (dependent.origin && !dependent.resolution) wrong("--origin", "only goes with --resolution");
	if (dependent.resolution)
	{
		const auto origin = dependent.origin.value_or(mrpt::math::TPoint2D(0, 0));
		command.map.image.emplace();
		command.map.image->resolution = *dependent.resolution;
		command.map.image->origin_x = origin.x;
		command.map.image->origin_y = origin.y;
	}
	command.output.rawlog_copy = !dependent.no_rawlog;
}

void check(const CommandLine& command)
{
	check_saved_map(command.output.save_map);
	if (command.only_writes_config() && !command.output.write_config.empty()) return;
	check_complete(command);
	check_live(command.log, command.output);
	check_without_folder(command);
	check_image(command.map);
}
}  // namespace

std::optional<CommandLine> parse_command_line(int argc, char** argv, std::ostream& out)
{
	CommandLine command;
	Dependent dependent;
	CLI::App app;
	set_up(app, kUsage);
	add_inputs({app, "Input"}, command, dependent);
	add_laser({app, "Laser"}, command.log, dependent);
	add_search({app, "Search"}, command.search, dependent);
	add_outputs({app, "Output"}, command.output, dependent);
	add_live({app, "Live"}, command);
	OptionGroup(app, "Help")
	    .help(
	        "rawlog-localize (d2s1r) " D2S1R_VERSION "\nreads " + logs::known_formats() + "\ncomputes with " +
	            simd_targets().front() + "\n",
	        out);
	if (!parse_words(app, kUsage, {argv + 1, argv + argc})) return std::nullopt;
	add_dependent(command, dependent);
	command.words.assign(argv, argv + argc);
	for (const CLI::Option* option : app.get_options())
		if (option->count() > 0) command.given[option->get_lnames().front()] = option->results().back();
	check(command);
	return command;
}
}  // namespace d2s1r::app
