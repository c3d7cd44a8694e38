// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What d2s1r-live makes of the command lines that launch files and `ros2 run` give to a node, and of its environment.
#include <shell/errors.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <set>
#include <sstream>

#include "flags.h"
#include "test_files.h"

namespace d2s1r::live
{
namespace
{
Flags flags_of(std::vector<std::string> words)
{
	words.insert(words.begin(), "d2s1r-live");
	std::vector<char*> pointers;
	for (std::string& word : words) pointers.push_back(word.data());
	std::ostringstream out;
	const auto flags = parse_flags(static_cast<int>(pointers.size()), pointers.data(), out);
	if (!flags) throw std::runtime_error("help was asked for");
	return *flags;
}

std::string help_text()
{
	std::string name = "d2s1r-live", help = "--help";
	char* words[] = {name.data(), help.data(), nullptr};
	std::ostringstream out;
	parse_flags(2, words, out);
	return out.str();
}

std::string refusal_of(const std::vector<std::string>& words)
{
	try
	{
		flags_of(words);
	}
	catch (const app::UserError& error)
	{
		EXPECT_EQ(error.status, app::kWrongUse);
		return error.what();
	}
	return "";
}

std::string topic(const std::vector<std::string>& words, const std::string& name)
{
	return flags_of(words).names.resolve(name);
}

/// A variable of the environment while a test runs.
struct Variable
{
	Variable(const char* given_name, const char* value) : name(given_name) { setenv(name, value, 1); }
	~Variable() { unsetenv(name); }
	Variable(const Variable&) = delete;
	Variable& operator=(const Variable&) = delete;
	const char* name;
};
}  // namespace

TEST(RosArguments, NamesAreRemappedAsInAnyNode)
{
	EXPECT_EQ(topic({}, "scan"), "/scan");
	EXPECT_EQ(topic({"--ros-args"}, "scan"), "/scan") << "launch always appends this";
	EXPECT_EQ(topic({"--ros-args", "-r", "scan:=/front/scan"}, "scan"), "/front/scan");
	EXPECT_EQ(topic({"--ros-args", "-r", "/scan:=front"}, "scan"), "/front");
	EXPECT_EQ(topic({"--ros-args", "--remap", "scan:=a", "-r", "scan:=b"}, "scan"), "/a") << "the first rule";
	EXPECT_EQ(topic({"--ros-args", "-r", "odom:=/o"}, "scan"), "/scan");
	const std::vector<std::string> robot = {
	    "--ros-args", "-r", "__ns:=/robot1",         "-r", "__node:=finder", "-r",
	    "/tf:=tf",    "-r", "/tf_static:=tf_static", "--", "--scan",         "front"};
	EXPECT_EQ(topic(robot, "scan"), "/robot1/scan");
	EXPECT_EQ(topic(robot, "/tf"), "/robot1/tf");
	EXPECT_EQ(topic(robot, "/tf_static"), "/robot1/tf_static");
	EXPECT_EQ(topic(robot, "/clock"), "/clock");
	EXPECT_EQ(topic(robot, "d2s1r/pose"), "/robot1/d2s1r/pose");
	EXPECT_EQ(topic(robot, "~/pose"), "/robot1/finder/pose");
	EXPECT_EQ(flags_of(robot).names.full(), "/robot1/finder");
	EXPECT_EQ(flags_of(robot).scans, std::vector<std::string>{"front"});
	EXPECT_EQ(topic({"--ros-args", "-r", "other:scan:=/x"}, "scan"), "/scan") << "of another node";
	EXPECT_EQ(topic({"--ros-args", "-r", "d2s1r_live:scan:=/x"}, "scan"), "/x");
}

namespace
{
/// A parameter with a value, and what it must do.
struct Effect
{
	std::string parameter, value;
	std::function<bool(const Flags&)> is_there;
};
}  // namespace

TEST(RosArguments, EveryOptionIsAParameter)
{
	const test::TempFolder folder;
	const std::string calibration = folder.write("laser.txt", "range-factor: 1.25\n");
	using Texts = std::vector<std::string>;
	const std::vector<Effect> effects = {
	    {"map", "plan.yaml", [](const Flags& f) { return f.map == "plan.yaml"; }},
	    {"config", "own.ini", [](const Flags& f) { return f.config == "own.ini"; }},
	    {"set", "[scan.no_return=1, fine.step=2]",
	     [](const Flags& f) {
		     return f.parameters == Texts{"scan.no_return=1", "fine.step=2"};
	     }},
	    {"index", "plan.index", [](const Flags& f) { return f.index == "plan.index"; }},
	    {"seed", "watch", [](const Flags& f) { return f.settings.seeding == Seeding::kWatch; }},
	    {"watch", "[3, 0.5]",
	     [](const Flags& f) { return f.settings.watch.scans == 3 && f.settings.watch.distance == 0.5; }},
	    {"seed_std", "0.2,0.05", [](const Flags& f) { return f.settings.seed_std_yaw == 0.05; }},
	    {"track", "true", [](const Flags& f) { return f.settings.track; }},
	    {"window", "7", [](const Flags& f) { return f.settings.window == 7; }},
	    {"region", "[-1.5, 0, 2, 3]", [](const Flags& f) { return !f.settings.region.anywhere(); }},
	    {"rate", "2", [](const Flags& f) { return f.settings.most_scans == 2; }},
	    {"scan", "/a", [](const Flags& f) { return f.scans == Texts{"/a"}; }},
	    {"merge_lasers", "true", [](const Flags& f) { return f.settings.merge_lasers; }},
	    {"cloud_height", "0.1:0.4",
	     [](const Flags& f) { return f.settings.cloud_height && f.settings.cloud_height->to == 0.4; }},
	    {"sweep_time", "0.1",
	     [](const Flags& f) { return f.settings.overrides.sweep && f.settings.overrides.sweep->duration == 0.1; }},
	    {"calibration", calibration, [](const Flags& f) { return f.settings.overrides.range_factor == 1.25; }},
	    {"as_told", "true", [](const Flags& f) { return f.settings.as_told; }},
	    {"map_topic", "/plan", [](const Flags& f) { return f.map_topic == "/plan"; }},
	    {"map_volatile", "true", [](const Flags& f) { return f.volatile_map; }},
	    {"odom", "/wheels", [](const Flags& f) { return f.odometry == "/wheels"; }},
	    {"tracker", "[/mcl, /b]",
	     [](const Flags& f) {
		     return f.trackers == Texts{"/mcl", "/b"};
	     }},
	    {"initialpose", "/set", [](const Flags& f) { return f.seeds == "/set"; }},
	    {"map_frame", "floor", [](const Flags& f) { return f.settings.map_frame == "floor"; }},
	    {"robot_frame", "base", [](const Flags& f) { return f.settings.robot_frame == "base"; }},
	    {"odom_frame", "wheel_odom", [](const Flags& f) { return f.settings.odometry_frame == "wheel_odom"; }},
	    {"domain", "7", [](const Flags& f) { return f.domain == 7; }},
	    {"quiet", "true", [](const Flags& f) { return f.quiet; }}};
	std::set<std::string> tried = {"help", "version"};
	for (const auto& [parameter, value, is_there] : effects)
	{
		EXPECT_FALSE(is_there(flags_of({}))) << parameter;
		const Flags flags = flags_of({"--ros-args", "-p", parameter + ":=" + value});
		EXPECT_TRUE(is_there(flags)) << parameter;
		EXPECT_TRUE(flags.notes.empty()) << parameter;
		std::string option = parameter;
		std::replace(option.begin(), option.end(), '_', '-');
		tried.insert(option);
	}
	std::istringstream help(help_text());
	for (std::string line; std::getline(help, line);)
	{
		const auto start = line.find("--");
		if (start > 6 || line.rfind("  ", 0) != 0) continue;
		EXPECT_EQ(tried.count(line.substr(start + 2, line.find_first_of(" ,", start) - start - 2)), 1U) << line;
	}
}

TEST(RosArguments, TheLastOneOfAParameterCountsAndOptionsWin)
{
	const Flags flags = flags_of(
	    {"--window", "3", "--ros-args", "-p", "window:=7", "-p", "index:=''", "-p", "index:=plan.index", "-p",
	     "use_sim_time:=true"});
	EXPECT_EQ(flags.settings.window, 3);
	EXPECT_EQ(flags.index, "plan.index");
	EXPECT_FALSE(flags.ignores_clock);
	EXPECT_TRUE(flags.notes.empty());
	EXPECT_TRUE(flags_of({"--ros-args", "-p", "use_sim_time:=False"}).ignores_clock);
	EXPECT_NE(refusal_of({"--ros-args", "-p", "seed:=maybe"}).find("'maybe' is not one of once"), std::string::npos);
	EXPECT_EQ(flags_of({"--ros-args", "-p", "scan:=[/a, /b]", "-p", "merge_lasers:=true"}).scans.size(), 2U);
}

TEST(RosArguments, AFileOfParametersIsReadForThisNode)
{
	const test::TempFolder folder;
	const std::string file = folder.write(
	    "params.yaml",
	    "/**:\n  ros__parameters: {use_sim_time: false, seed: never}\n"
	    "amcl:\n  ros__parameters: {window: 9}\n"
	    "robot1:\n  finder:\n    ros__parameters: {seed: watch, watch: [5, 0.3], scan: [/a], nested: {x: 1}}\n"
	    "/*/other:\n  ros__parameters: {rate: 1}\n");
	const std::vector<std::string> words = {"--ros-args", "--params-file", file, "-r", "__ns:=/robot1",
	                                        "-r",         "__node:=finder"};
	const Flags flags = flags_of(words);
	EXPECT_EQ(flags.settings.seeding, Seeding::kWatch);
	EXPECT_EQ(flags.settings.watch.scans, 5);
	EXPECT_EQ(flags.settings.window, 5) << "that of another node";
	EXPECT_EQ(flags.settings.most_scans, 0);
	EXPECT_TRUE(flags.ignores_clock);
	ASSERT_EQ(flags.notes.size(), 1U);
	EXPECT_EQ(flags.notes.front().find("parameter 'nested.x' is not an option"), 0U) << flags.notes.front();
	EXPECT_EQ(flags_of({"--ros-args", "--params-file", file}).settings.seeding, Seeding::kNever) << "that of all nodes";
	std::vector<std::string> later = words;
	later.insert(later.end(), {"-p", "seed:=once"});
	EXPECT_EQ(flags_of(later).settings.seeding, Seeding::kOnce);
	EXPECT_NE(
	    refusal_of({"--ros-args", "--params-file", "none.yaml"}).find("none.yaml: cannot be read"), std::string::npos);
	const std::string broken = folder.write("broken.yaml", "a: [\n");
	EXPECT_NE(refusal_of({"--ros-args", "--params-file", broken}).find("is not yaml"), std::string::npos);
}

TEST(RosArguments, WhatHasNoEffectIsALine)
{
	const Flags flags = flags_of(
	    {"--ros-args", "--enclave", "/x", "--disable-rosout-logs", "--log-level", "info", "-p", "seedd:=watch"});
	ASSERT_EQ(flags.notes.size(), 3U);
	EXPECT_EQ(flags.notes[2], "parameter 'seedd' is not an option; did you mean seed?");
	EXPECT_FALSE(flags.quiet);
	EXPECT_TRUE(flags_of({"--ros-args", "--log-level", "rcl:=ERROR"}).quiet);
}

TEST(RosArguments, WhatIsMalformedIsRefused)
{
	EXPECT_NE(refusal_of({"--ros-args", "-r"}).find("-r: needs a value"), std::string::npos);
	EXPECT_NE(refusal_of({"--ros-args", "-r", "scan"}).find("write NAME:=VALUE"), std::string::npos);
	EXPECT_NE(refusal_of({"--ros-args", "--scan", "/x"}).find("--scan: is not an argument of ROS"), std::string::npos);
	EXPECT_NE(refusal_of({"scan:=/x"}).find("write --ros-args -r scan:=/x"), std::string::npos);
	EXPECT_NE(refusal_of({"--ros-args", "--params-file", "/"}).find("it is a folder"), std::string::npos);
	EXPECT_NE(refusal_of({"--ros-args", "--log-level", "loud"}).find("loud: is not a level"), std::string::npos);
	const test::TempFolder folder;
	for (const std::string many : {"/**: {ros__parameters: &x {a: *x, b: *x}}\n", "&x {a: *x, b: *x}\n"})
	{
		const std::string within = folder.write("within.yaml", many);
		EXPECT_EQ(
		    refusal_of({"--ros-args", "--params-file", within}),
		    within + ": holds more than 10,000 parameters; name the right yaml file");
	}
	const std::string file = folder.write("long.yaml", std::string(300'000, '#') + "\n");
	EXPECT_EQ(
	    refusal_of({"--ros-args", "--params-file", file}), file + ": is longer than 256 kB; name the right yaml file");
}

TEST(RosArguments, ParametersThatAreTrueOrFalseAreNothingElse)
{
	for (const std::string wrong : {"5", "maybe", "[true, true]"})
		for (const std::string name : {"track", "use_sim_time"})
			EXPECT_EQ(refusal_of({"--ros-args", "-p", name + ":=" + wrong}).find("parameter '" + name + "': '"), 0U)
			    << name << " " << wrong;
	EXPECT_TRUE(flags_of({"--ros-args", "-p", "track:=yes"}).settings.track);
	EXPECT_FALSE(flags_of({"--ros-args", "-p", "track:=off"}).settings.track);
	EXPECT_TRUE(flags_of({"--ros-args", "-p", "use_sim_time:=FALSE"}).ignores_clock);
	EXPECT_FALSE(flags_of({"--ros-args", "-p", "use_sim_time:=[]"}).ignores_clock) << "as if not given";
	EXPECT_EQ(flags_of({"--ros-args", "-p", "track:={of: 1}"}).notes.size(), 1U) << "track.of is no option";
}

TEST(RosArguments, NamesThatRosCannotHaveAreRefused)
{
	for (const std::string wrong : {"front scan", "/front//scan", "/front/", "1scan", "/front-scan", "{ns}"})
		EXPECT_THROW(topic({"--ros-args", "-r", "scan:=" + wrong}, "scan"), app::UserError) << wrong;
	EXPECT_THROW(topic({"--ros-args", "-r", "__ns:=robot 1"}, "scan"), app::UserError);
	EXPECT_THROW(topic({}, "/front scan"), app::UserError);
	for (const std::string wrong : {"a b", "a/b", "7"})
		EXPECT_EQ(refusal_of({"--ros-args", "-r", "__node:=" + wrong}).find(wrong + ": is no name in ROS"), 0U);
	EXPECT_EQ(topic({"--ros-args", "-r", "rostopic://:=x"}, "scan"), "/scan");
}

TEST(Environment, SaysWhichPeersAreFound)
{
	EXPECT_EQ(flags_of({}).discovery.settings, std::vector<std::string>{""});
	const auto settings_with = [](const char* name, const char* value)
	{
		const Variable variable(name, value);
		return flags_of({}).discovery.settings.front();
	};
	EXPECT_NE(settings_with("ROS_LOCALHOST_ONLY", "1").find("127.0.0.1"), std::string::npos);
	EXPECT_EQ(settings_with("ROS_LOCALHOST_ONLY", "0"), "");
	EXPECT_NE(settings_with("ROS_AUTOMATIC_DISCOVERY_RANGE", "localhost").find("127.0.0.1"), std::string::npos);
	EXPECT_NE(settings_with("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF").find("<Tag>"), std::string::npos);
	EXPECT_EQ(settings_with("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"), "");
	EXPECT_EQ(settings_with("ROS_AUTOMATIC_DISCOVERY_RANGE", "SYSTEM_DEFAULT"), "");
	const std::string peers = settings_with("ROS_STATIC_PEERS", "192.0.2.7;robot.local");
	EXPECT_NE(peers.find("<Peer address=\"192.0.2.7\"/><Peer address=\"robot.local\"/>"), std::string::npos);
	const Variable range("ROS_AUTOMATIC_DISCOVERY_RANGE", "HOUSE");
	EXPECT_NE(refusal_of({}).find("'HOUSE' is not one of SUBNET"), std::string::npos);
}

TEST(Environment, NamesWhatCannotBeJoined)
{
	const Variable server("ROS_DISCOVERY_SERVER", "127.0.0.1:11811"), zenoh("RMW_IMPLEMENTATION", "rmw_zenoh_cpp");
	const auto notes = flags_of({}).notes;
	ASSERT_EQ(notes.size(), 2U);
	EXPECT_EQ(notes[0].find("RMW_IMPLEMENTATION is rmw_zenoh_cpp"), 0U);
	EXPECT_EQ(notes[1].find("ROS_DISCOVERY_SERVER is 127.0.0.1:11811"), 0U);
	const Variable fast("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp");
	EXPECT_EQ(flags_of({}).notes.size(), 1U);
}
}  // namespace d2s1r::live
