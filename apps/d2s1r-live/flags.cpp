// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "flags.h"

#include <CLI/CLI.hpp>
#include <d2s1r/version.h>
#include <shell/errors.h>
#include <shell/options.h>
#include <shell/values.h>

#include <array>
#include <cstdlib>
#include <stdexcept>

namespace d2s1r::live
{
namespace
{
constexpr app::Usage kUsage = {
    "d2s1r-live",
    "Usage: d2s1r-live [OPTION]...\n"
    "Wait for a map and for the scans of a robot that runs ROS 2, find the robot without an initial pose,\n"
    "seed its tracker on /initialpose, and notice when the tracker is lost. All options may be left out.\n\n",
    "", ""};

[[noreturn]] void wrong(const std::string& flag, const std::string& what)
{
	app::refuse_option(kUsage.program, flag, what);
}

Seeding parse_seeding(const std::string& text)
{
	if (text == "once") return Seeding::kOnce;
	if (text == "watch") return Seeding::kWatch;
	if (text != "never") app::refuse_value(text, "is not one of once, watch, never");
	return Seeding::kNever;
}

std::uint32_t parse_domain(const std::string& text)
{
	constexpr int kGreatest = 232;  // of which all ports exist
	return static_cast<std::uint32_t>(app::parse_whole_number(text, 0, kGreatest));
}

/// Returns the domain of the environment.
std::uint32_t usual_domain()
{
	const char* const variable = std::getenv("ROS_DOMAIN_ID");
	if (variable == nullptr || *variable == '\0') return 0;
	try
	{
		return parse_domain(variable);
	}
	catch (const std::invalid_argument& error)
	{
		wrong("ROS_DOMAIN_ID", error.what());
	}
}

void add_map_options(app::OptionGroup map, Flags& flags)
{
	map.value("-m,--map", "FILE|ATLAS", "the map or atlas to localize in, instead of the topic of maps", flags.map);
	map.value(
	    "-c,--config", "CONFIG.ini", "read parameters from this file; those not in the file keep their defaults",
	    flags.config);
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
		    const auto values = app::parse_number_list(text);
		    if (values.size() != 2 || values[0] < 0 || values[1] < 0)
			    app::refuse_value(text, "is not a pair of standard deviations from 0 up; write M,RAD");
		    settings.seed_std = values[0], settings.seed_std_yaw = values[1];
	    });
}

void add_search_options(app::OptionGroup search, LiveSettings& settings)
{
	constexpr int kMostScans = 1000;
	search.value(
	    "--window", "N", "use the last N scans jointly (default 5)",
	    [&](const std::string& text)
	    { settings.window = static_cast<int>(app::parse_whole_number(text, 1, kMostScans)); });
	search.value(
	    "--region", "X0,Y0,X1,Y1", "search only in the box between these two corners [m], map frame; not with an atlas",
	    [&](const std::string& text) { settings.region = app::parse_region(text); });
	search.value(
	    "--rate", "HZ", "localize at most this many scans each second (default: all)",
	    [&](const std::string& text)
	    {
		    settings.most_scans = app::parse_finite_number(text);
		    if (settings.most_scans <= 0) app::refuse_value(text, "is not above 0; leave it out for all scans");
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
	    [&](const std::string& text) { settings.sweep = app::parse_sweep_time(text); });
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
	    [&](const std::string& text) { flags.domain = parse_domain(text); });
	topics.flag("-q,--quiet", "print errors only", flags.quiet);
}

/// Refuses words that a node of ROS understands and this program does not, and says what to write instead.
void refuse_ros_arguments(int argc, char** argv)
{
	const std::string kAssigned = ":=";
	constexpr std::array<std::pair<const char*, const char*>, 6> kTopics = {
	    {{"scan", "--scan"},
	     {"map", "--map-topic"},
	     {"odom", "--odom"},
	     {"initialpose", "--initialpose"},
	     {"amcl_pose", "--tracker"},
	     {"pf_pose", "--tracker"}}};
	bool has_ros_arguments = false;
	for (int i = 1; i < argc; i++)
	{
		const std::string word = argv[i];
		has_ros_arguments = has_ros_arguments || word == "--ros-args";
		const auto at = word.find(kAssigned);
		if (at == std::string::npos) continue;
		std::string name = word.substr(0, at);
		if (name.rfind('/', 0) == 0) name.erase(0, 1);
		for (const auto& [topic, option] : kTopics)
			if (name == topic)
				wrong(
				    word, "d2s1r-live does not read remappings of ROS; write " + std::string(option) + " " +
				              word.substr(at + kAssigned.size()));
		if (name == "use_sim_time")
			wrong(word, "d2s1r-live follows /clock whenever somebody publishes it; leave this parameter out");
		wrong(word, "d2s1r-live does not read remappings and parameters of ROS; its options name topics and frames");
	}
	if (has_ros_arguments)
		wrong(
		    "--ros-args", "d2s1r-live does not read arguments of ROS; its options name topics, such as --scan /front");
}
}  // namespace

std::optional<Flags> parse_flags(int argc, char** argv, std::ostream& out)
{
	refuse_ros_arguments(argc, argv);
	Flags flags;
	CLI::App parser;
	app::set_up(parser, kUsage);
	add_map_options({parser, "Map"}, flags);
	add_seed_options({parser, "Seeds"}, flags.settings);
	add_search_options({parser, "Search"}, flags.settings);
	add_laser_options({parser, "Laser"}, flags);
	add_topic_options({parser, "Topics and frames"}, flags);
	app::OptionGroup(parser, "Help").help("d2s1r-live " D2S1R_VERSION "\n", out);
	if (!app::parse_words(parser, kUsage, {argv + 1, argv + argc})) return std::nullopt;
	if (parser.count("--domain") == 0) flags.domain = usual_domain();
	flags.settings.has_maps_of_its_own = !flags.map.empty();
	if (flags.scans.size() > 1 && !flags.settings.merge_lasers)
		wrong("--scan", "several lasers only go with --merge-lasers");
	return flags;
}
}  // namespace d2s1r::live
