// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "flags.h"

#include <CLI/CLI.hpp>
#include <base/spelling.h>
#include <d2s1r/version.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>

#include "errors.h"

namespace d2s1r::live
{
namespace
{
[[noreturn]] void wrong(const std::string& flag, const std::string& what)
{
	throw UserError(kWrongUse, flag, what + "; see d2s1r-live --help");
}

template <class Number>
std::optional<Number> number_of(const std::string& text)
{
	Number number{};
	const char* const end = text.data() + text.size();
	const auto [parsed_to, error] = std::from_chars(text.data(), end, number);
	if (error != std::errc() || parsed_to != end || text.empty()) return std::nullopt;
	return number;
}

std::vector<double> parse_numbers(const std::string& flag, const std::string& text, std::size_t count, const char* form)
{
	std::vector<double> numbers;
	std::istringstream in(text + ",");
	for (std::string part; std::getline(in, part, ',');)
	{
		const auto number = number_of<double>(part);
		if (!number || !std::isfinite(*number)) wrong(flag, "'" + part + "' is not a finite number; write " + form);
		numbers.push_back(*number);
	}
	if (numbers.size() != count) wrong(flag, "'" + text + "' has another form; write " + form);
	return numbers;
}

int parse_count(const std::string& flag, const std::string& text, int least, int greatest)
{
	const auto number = number_of<int>(text);
	if (!number || *number < least || *number > greatest)
		wrong(
		    flag,
		    "'" + text + "' is not a whole number from " + std::to_string(least) + " to " + std::to_string(greatest));
	return *number;
}

ros::HeightBand parse_heights(const std::string& text)
{
	const std::string flag = "--cloud-height";
	std::string numbers = text;
	const auto colon = numbers.find(':');
	if (colon == std::string::npos) wrong(flag, "'" + text + "' has another form; write A:B in m");
	numbers[colon] = ',';
	const auto heights = parse_numbers(flag, numbers, 2, "A:B in m");
	if (!(heights[0] < heights[1])) wrong(flag, "'" + text + "' is an empty band; write the lower height first");
	return {heights[0], heights[1]};
}

Seeding parse_seeding(const std::string& text)
{
	if (text == "once") return Seeding::kOnce;
	if (text == "watch") return Seeding::kWatch;
	if (text != "never") wrong("--seed", "'" + text + "' is not one of once, watch, never");
	return Seeding::kNever;
}

/// Returns the domain that was given, else that of ROS_DOMAIN_ID.
std::uint32_t parse_domain(const std::string& text)
{
	constexpr int kGreatest = 232;  // of which all ports exist
	const char* const variable = std::getenv("ROS_DOMAIN_ID");
	if (!text.empty()) return static_cast<std::uint32_t>(parse_count("--domain", text, 0, kGreatest));
	if (variable == nullptr || *variable == '\0') return 0;
	return static_cast<std::uint32_t>(parse_count("ROS_DOMAIN_ID", variable, 0, kGreatest));
}

/// The options as they are written, before their values are looked at.
struct Texts
{
	std::string seed = "once", window, region, seed_std, watch, rate, domain, cloud_height, sweep_time;
};

void define(CLI::App& app, Flags& flags, Texts& texts)
{
	app.add_option("-m,--map", flags.map, "the map or atlas to localize in, instead of the topic of maps")
	    ->type_name("FILE|ATLAS");
	app.add_option(
	       "-c,--config", flags.config, "read parameters from this file; those not in the file keep their defaults")
	    ->type_name("CONFIG.ini");
	app.add_option(
	       "--index", flags.settings.index,
	       "keep the index of the map in FILE, so that the next start takes a fraction of the time; not with an atlas")
	    ->type_name("FILE");
	app.add_option("--seed", texts.seed, "when to seed the tracker: once (default), watch (whenever it is lost), never")
	    ->type_name("WHEN");
	app.add_option(
	       "--watch", texts.watch, "call the tracker lost after N scans in a row that are METRES away (default 4,0.4)")
	    ->type_name("N,METRES");
	app.add_option("--seed-std", texts.seed_std, "add this to the uncertainty of a seed [m, rad] (default 0.3,0.1)")
	    ->type_name("M,RAD");
	app.add_option("--window", texts.window, "use the last N scans jointly (default 5)")->type_name("N");
	app.add_option(
	       "--region", texts.region,
	       "search only in the box between these two corners [m], map frame; not with an atlas")
	    ->type_name("X0,Y0,X1,Y1");
	app.add_option("--rate", texts.rate, "localize at most this many scans each second (default: all)")
	    ->type_name("HZ");
	app.add_flag("--merge-lasers", flags.settings.merge_lasers, "use the scans of all --scan topics together");
	app.add_option("--scan", flags.scans, "the topic of a laser; may be given several times (default /scan)")
	    ->type_name("TOPIC");
	app.add_option(
	       "--cloud-height", texts.cloud_height,
	       "read PointCloud2 from the topics of --scan; the points between A and B [m] above the robot's frame make a "
	       "scan")
	    ->type_name("A:B");
	app.add_option(
	       "--sweep-time", texts.sweep_time,
	       "the time from the first beam of a scan to the last [s], in place of what the messages tell")
	    ->type_name("S");
	app.add_option("--map-topic", flags.map_topic, "the topic of maps (default /map)")->type_name("TOPIC");
	app.add_flag(
	    "--map-volatile", flags.volatile_map,
	    "read a map whose publisher does not keep it for late readers (volatile)");
	app.add_option("--odom", flags.odometry, "the topic of odometry (default /odom)")->type_name("TOPIC");
	app.add_option("--tracker", flags.trackers, "the topic of the tracker's pose (default /amcl_pose and /pf_pose)")
	    ->type_name("TOPIC");
	app.add_option("--initialpose", flags.seeds, "the topic of the seeds (default /initialpose)")->type_name("TOPIC");
	app.add_option("--map-frame", flags.settings.map_frame, "the frame of the map of --map (default map)")
	    ->type_name("FRAME");
	app.add_option("--robot-frame", flags.settings.robot_frame, "the frame of the robot (default: see the manual)")
	    ->type_name("FRAME");
	app.add_option("--odom-frame", flags.settings.odometry_frame, "the frame of the odometry (default: see the manual)")
	    ->type_name("FRAME");
	app.add_option("--domain", texts.domain, "the domain of ROS 2 (default: ROS_DOMAIN_ID, else 0)")->type_name("ID");
	app.add_flag("-q,--quiet", flags.quiet, "print errors only");
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

/// Refuses a word that is none of the options, and names the option that it may have been meant to be.
[[noreturn]] void refuse_unknown(const CLI::App& app, const std::string& word)
{
	if (word.rfind('-', 0) != 0) wrong(word, "stands without an option");
	std::vector<std::string> names;
	for (const CLI::Option* option : app.get_options())
		for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
	const std::string given = word.substr(0, word.find('='));
	throw UserError(kWrongUse, given, not_an_option(given, names, "d2s1r-live --help"));
}

void read_values(const Texts& texts, Flags& flags)
{
	constexpr int kMostScans = 1000;
	LiveSettings& settings = flags.settings;
	settings.seeding = parse_seeding(texts.seed);
	settings.has_maps_of_its_own = !flags.map.empty();
	if (!texts.window.empty()) settings.window = parse_count("--window", texts.window, 1, kMostScans);
	flags.domain = parse_domain(texts.domain);
	if (!texts.watch.empty())
	{
		const auto values = parse_numbers("--watch", texts.watch, 2, "N,METRES");
		settings.watch.scans = parse_count("--watch", texts.watch.substr(0, texts.watch.find(',')), 1, kMostScans);
		settings.watch.distance = values[1];
		if (values[1] <= 0) wrong("--watch", "the distance must be above 0 m");
	}
	if (!texts.seed_std.empty())
	{
		const auto values = parse_numbers("--seed-std", texts.seed_std, 2, "M,RAD");
		if (values[0] < 0 || values[1] < 0) wrong("--seed-std", "a standard deviation must not be below 0");
		settings.seed_std = values[0], settings.seed_std_yaw = values[1];
	}
	if (!texts.cloud_height.empty()) settings.cloud_height = parse_heights(texts.cloud_height);
	if (!texts.sweep_time.empty())
	{
		constexpr double kLongest = 2;  // [s]
		const double time = parse_numbers("--sweep-time", texts.sweep_time, 1, "a time in s")[0];
		if (std::abs(time) > kLongest) wrong("--sweep-time", "is longer than any laser takes; write at most 2 s");
		settings.sweep = ros::SweepTime{time, 0};
	}
	if (!texts.rate.empty()) settings.most_scans = parse_numbers("--rate", texts.rate, 1, "scans each second")[0];
	if (!texts.rate.empty() && settings.most_scans <= 0) wrong("--rate", "must be above 0; leave it out for all scans");
	if (!texts.region.empty())
	{
		const auto box = parse_numbers("--region", texts.region, 4, "X0,Y0,X1,Y1 in m");
		if (box[0] == box[2] || box[1] == box[3]) wrong("--region", "is an empty box; give two opposite corners");
		settings.region = make_prior(box[0], box[1], box[2], box[3]);
	}
	if (flags.scans.size() > 1 && !settings.merge_lasers) wrong("--scan", "several lasers only go with --merge-lasers");
}
}  // namespace

std::optional<Flags> parse_flags(int argc, char** argv, std::ostream& out)
{
	Flags flags;
	Texts texts;
	CLI::App app(
	    "Wait for a map and for the scans of a robot that runs ROS 2, find the robot without an initial pose,\n"
	    "seed its tracker on /initialpose, and notice when the tracker is lost. All options may be left out.");
	define(app, flags, texts);
	app.set_version_flag("--version", "d2s1r-live " D2S1R_VERSION);
	app.allow_extras();
	refuse_ros_arguments(argc, argv);
	try
	{
		app.parse(argc, argv);
	}
	catch (const CLI::CallForHelp&)
	{
		out << app.help();
		return std::nullopt;
	}
	catch (const CLI::CallForVersion&)
	{
		out << "d2s1r-live " D2S1R_VERSION << '\n';
		return std::nullopt;
	}
	catch (const CLI::ArgumentMismatch& e)
	{
		const std::string last = argv[argc - 1];  // only this word can lack what comes after it
		if (last.rfind('-', 0) == 0) wrong(last, "needs a value");
		wrong("command line", e.what());  // an option is given twice
	}
	catch (const CLI::Error& e)
	{
		throw UserError(kWrongUse, "command line", std::string(e.what()) + "; see d2s1r-live --help");
	}
	if (const auto unknown = app.remaining(); !unknown.empty()) refuse_unknown(app, unknown.front());
	read_values(texts, flags);
	return flags;
}
}  // namespace d2s1r::live
