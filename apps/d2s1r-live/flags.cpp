// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "flags.h"

#include <CLI/CLI.hpp>
#include <base/spelling.h>
#include <d2s1r/version.h>
#include <shell/errors.h>
#include <shell/options.h>
#include <shell/values.h>

#include <algorithm>
#include <map>
#include <stdexcept>

namespace d2s1r::live
{
namespace
{
const app::Usage kUsage = {
    "d2s1r-live",
    "Usage: d2s1r-live [OPTION]...\n"
    "Wait for a map and for the scans of a robot that runs ROS 2, find the robot without an initial pose,\n"
    "seed its tracker on /initialpose, and notice when the tracker is lost. All options may be left out.\n\n",
    "", "; write --map MAP or --scan TOPIC"};

[[noreturn]] void wrong(const std::string& flag, const std::string& what)
{
	app::refuse_option(kUsage.program, flag, what);
}

Seeding parse_seeding(const std::string& text)
{
	if (text == "once") return Seeding::kOnce;
	if (text == "watch") return Seeding::kWatch;
	if (text != "never") refuse_value(text, "is not one of once, watch, never");
	return Seeding::kNever;
}

void add_map_options(app::OptionGroup map, Flags& flags)
{
	map.value("-m,--map", "FILE|ATLAS", "the map or atlas to localize in, instead of the topic of maps", flags.map);
	map.value(
	    "-c,--config", "CONFIG.ini", "read parameters from this file; those not in the file keep their defaults",
	    flags.config);
	map.values(
	    "--set", "SECTION.KEY=VALUE",
	    "set a parameter, which wins over --config; may be given several times, as in --set scan.no_return=1",
	    flags.parameters);
	map.value(
	    "--index", "FILE",
	    "keep the index of the map in FILE, so that the next start takes a fraction of the time; not with an atlas",
	    flags.index);
}

void add_seed_options(app::OptionGroup seeds, LiveSettings& settings)
{
	seeds.value(
	    "--seed", "WHEN", "when to seed the tracker: once (default), watch (whenever it is lost), never",
	    [&](const std::string& text) { settings.seeding = parse_seeding(text); });
	seeds.value(
	    "--watch", "N,METRES", "call the tracker lost after N scans in a row that are METRES away (default 4,0.4)",
	    [&](const std::string& text) { settings.watch = app::parse_watch(text); });
	seeds.value(
	    "--seed-std", "M,RAD", "add this to the uncertainty of a seed [m, rad] (default 0.3,0.1)",
	    [&](const std::string& text)
	    {
		    const auto values = parse_number_list(text);
		    if (values.size() != 2 || values[0] < 0 || values[1] < 0)
			    refuse_value(text, "is not a pair of standard deviations from 0 up; write M,RAD");
		    settings.seed_std = values[0], settings.seed_std_yaw = values[1];
	    });
}

void add_tracking_options(app::OptionGroup tracking, LiveSettings& settings)
{
	tracking.flag(
	    "--track",
	    "follow the robot instead of seeding a tracker: publish map -> odom on /tf and the pose at the rate of the "
	    "odometry, and read poses that a person gives from the topic of --initialpose",
	    settings.track);
}

void add_search_options(app::OptionGroup search, LiveSettings& settings)
{
	constexpr int kMostScans = 1000;
	search.value(
	    "--window", "N", "use the last N scans jointly (default 5)",
	    [&](const std::string& text) { settings.window = static_cast<int>(parse_whole_number(text, 1, kMostScans)); });
	search.value(
	    "--region", "X0,Y0,X1,Y1", "search only in the box between these two corners [m], map frame; not with an atlas",
	    [&](const std::string& text) { settings.region = app::parse_region(text); });
	search.value(
	    "--rate", "HZ", "localize at most this many scans each second (default: all; 20 with --track)",
	    [&](const std::string& text)
	    {
		    settings.most_scans = parse_finite_number(text);
		    if (settings.most_scans <= 0) refuse_value(text, "is not above 0; leave it out for all scans");
	    });
}

void add_laser_options(app::OptionGroup laser, Flags& flags)
{
	LiveSettings& settings = flags.settings;
	laser.values("--scan", "TOPIC", "the topic of a laser; may be given several times (default /scan)", flags.scans);
	laser.flag("--merge-lasers", "use the scans of all --scan topics together", settings.merge_lasers);
	laser.value(
	    "--cloud-height", "A:B",
	    "read PointCloud2 from the topics of --scan; the points between A and B [m] above the robot's frame make a "
	    "scan",
	    [&](const std::string& text) { settings.cloud_height = app::parse_height_band(text); });
	laser.value(
	    "--sweep-time", "S",
	    "the time from the first beam of a scan to the last [s], in place of what the messages tell",
	    [&](const std::string& text) { ros::enter("sweep-time", text, settings.overrides); });
	laser.value(
	    "--calibration", "FILE",
	    "read the laser, which must be the first of --scan, and the odometry as FILE says, which rawlog-localize "
	    "--calibrate wrote",
	    flags.calibration);
	laser.flag(
	    "--as-told",
	    "believe what the messages say of the laser and the odometry, even if the drive through the map contradicts it",
	    settings.as_told);
}

void add_topic_options(app::OptionGroup topics, Flags& flags)
{
	topics.value("--map-topic", "TOPIC", "the topic of maps (default /map)", flags.map_topic);
	topics.flag(
	    "--map-volatile", "read a map whose publisher does not keep it for late readers (volatile)",
	    flags.volatile_map);
	topics.value("--odom", "TOPIC", "the topic of odometry (default /odom)", flags.odometry);
	topics.values(
	    "--tracker", "TOPIC", "the topic of the tracker's pose (default /amcl_pose and /pf_pose)", flags.trackers);
	topics.value("--initialpose", "TOPIC", "the topic of the seeds (default /initialpose)", flags.seeds);
	topics.value("--map-frame", "FRAME", "the frame of the map of --map (default map)", flags.settings.map_frame);
	topics.value(
	    "--robot-frame", "FRAME", "the frame of the robot (default: see the manual)", flags.settings.robot_frame);
	topics.value(
	    "--odom-frame", "FRAME", "the frame of the odometry (default: see the manual)", flags.settings.odometry_frame);
	topics.value(
	    "--domain", "ID", "the domain of ROS 2 (default: ROS_DOMAIN_ID, else 0)",
	    [&](const std::string& text)
	    { flags.domain = static_cast<std::uint32_t>(parse_whole_number(text, 0, kGreatestDomain)); });
	topics.flag("-q,--quiet", "print errors only", flags.quiet);
}

/// Returns the option that a parameter of the node sets; null if there is none.
const CLI::Option* option_of(const CLI::App& parser, const std::string& parameter)
{
	std::string name = "--" + parameter;
	std::replace(name.begin(), name.end(), '_', '-');
	return name == "--help" || name == "--version" ? nullptr : parser.get_option_no_throw(name);
}

/// Returns a line about parameters that are none of the program; empty if there is none.
std::string note_on_unknown(const CLI::App& parser, const std::vector<std::string>& unknown)
{
	constexpr std::size_t kMostNamed = 5;
	if (unknown.empty()) return "";
	if (unknown.size() == 1)
	{
		std::vector<std::string> names;
		for (const CLI::Option* option : parser.get_options()) names.push_back(option->get_lnames().front());
		return "parameter '" + unknown.front() + "' " + not_an_option(unknown.front(), names, "d2s1r-live --help");
	}
	std::string line = "these parameters are not options, see d2s1r-live --help: ";
	for (std::size_t i = 0; i < std::min(unknown.size(), kMostNamed); i++) line += (i > 0 ? ", " : "") + unknown[i];
	if (unknown.size() > kMostNamed) line += " and " + std::to_string(unknown.size() - kMostNamed) + " others";
	return line;
}

std::string joined(const std::vector<std::string>& texts)
{
	std::string all;
	for (const std::string& text : texts) all += (all.empty() ? "" : ",") + text;
	return all;
}

bool parse_truth(const std::string& parameter, std::string text)
{
	std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
	if (text == "true" || text == "yes" || text == "on" || text == "y") return true;
	if (text != "false" && text != "no" && text != "off" && text != "n")
		throw app::UserError(app::kWrongUse, "parameter '" + parameter + "'", "'" + text + "' is not true or false");
	return false;
}

/// Returns the words that say the same as parameters of the node. Those without a value count as not given.
std::vector<std::string> words_of(const CLI::App& parser, const std::vector<Parameter>& parameters, Flags& flags)
{
	std::map<const CLI::Option*, std::vector<std::string>> values;  // the last ones
	std::vector<std::string> unknown;
	for (const Parameter& parameter : parameters)
		if (const CLI::Option* const option = option_of(parser, parameter.name))
			values[option] = parameter.values;
		else if (parameter.name == "use_sim_time")
		{
			const std::string text = joined(parameter.values);
			flags.ignores_clock = !text.empty() && !parse_truth(parameter.name, text);
		}
		else
			unknown.push_back(parameter.name);
	if (const std::string note = note_on_unknown(parser, unknown); !note.empty()) flags.notes.push_back(note);
	std::vector<std::string> words;
	for (const auto& [option, texts] : values)
	{
		const std::string name = "--" + option->get_lnames().front(), text = joined(texts);
		if (option->get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll)
			for (const std::string& one : texts) words.push_back(name + "=" + one);
		else if (!text.empty() && option->get_items_expected_max() > 0)
			words.push_back(name + "=" + text);
		else if (!text.empty() && parse_truth(option->get_lnames().front(), text))
			words.push_back(name);
	}
	return words;
}
}  // namespace

std::optional<Flags> parse_flags(int argc, char** argv, std::ostream& out)
{
	const RosArguments ros = parse_ros_arguments(argc, argv);
	Flags flags;
	flags.names = ros.names;
	flags.notes = ros.notes;
	flags.quiet = ros.errors_only;
	flags.domain = domain_of_environment();
	flags.discovery = discovery_of_environment();
	CLI::App parser;
	app::set_up(parser, kUsage);
	add_map_options({parser, "Map"}, flags);
	add_seed_options({parser, "Seeds"}, flags.settings);
	add_tracking_options({parser, "Tracking"}, flags.settings);
	add_search_options({parser, "Search"}, flags.settings);
	add_laser_options({parser, "Laser"}, flags);
	add_topic_options({parser, "Topics and frames"}, flags);
	app::OptionGroup(parser, "Help").help("d2s1r-live " D2S1R_VERSION "\n", out);
	app::parse_words(parser, kUsage, words_of(parser, ros.parameters, flags));
	if (!app::parse_words(parser, kUsage, ros.words)) return std::nullopt;  // they win over parameters
	if (!flags.calibration.empty()) app::read_calibration(flags.calibration, flags.settings.overrides);
	flags.settings.has_maps_of_its_own = !flags.map.empty();
	if (flags.scans.size() > 1 && !flags.settings.merge_lasers)
		wrong("--scan", "several lasers only go with --merge-lasers");
	if (flags.settings.track && parser.count("--seed") > 0)
		wrong("--track", "does not go with --seed: there is no tracker to seed; leave one of them out");
	if (flags.settings.track) flags.settings.seeding = Seeding::kNever;
	flags.notes.insert(flags.notes.end(), flags.discovery.notes.begin(), flags.discovery.notes.end());
	return flags;
}
}  // namespace d2s1r::live
