// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A simulated robot of ROS 2 that drives through a map: to see d2s1r-live at work without a robot, and for long runs.
#include <base/errors.h>
#include <d2s1r/version.h>
#include <shell/errors.h>
#include <shell/options.h>
#include <shell/values.h>

#include <cstdlib>
#include <iostream>

#include "environment.h"
#include "tracker.h"

namespace
{
using namespace d2s1r;
using namespace d2s1r::drive;

const app::Usage kUsage = {
    "d2s1r-live-drive",
    "Usage: d2s1r-live-drive MAP SECONDS [MARKERS.json] [OPTION]...\n"
    "Drive a simulated robot of ROS 2 through a map. It publishes /map, /tf_static, /tf, /odom and /scan, and its\n"
    "tracker takes the seeds of /initialpose as amcl does. At the end a line says how often d2s1r-live and the "
    "tracker\n"
    "were right. MARKERS.json gets the markers with the most hypotheses.\n\n",
    "", ""};

auto number(double& value, double least)
{
	return [&value, least](const std::string& text)
	{
		value = parse_finite_number(text);
		if (value < least) refuse_value(text, "is below " + std::to_string(least));
	};
}

void add_options(CLI::App& parser, DriveSettings& settings)
{
	WorldSettings& world = settings.world;
	const auto count = [](int& value, std::uint64_t least)
	{
		return [&value, least](const std::string& text)
		{ value = static_cast<int>(parse_whole_number(text, least, 100'000)); };
	};
	app::OptionGroup robot(parser, "Robot");
	robot.value("--beams", "N", "the number of beams of a scan (default 360)", count(world.beams, 2));
	robot.value("--field-of-view", "DEG", "of the laser (default 360)", number(world.field_of_view, 1));
	robot.value("--scan-rate", "HZ", "scans a second (default 10)", number(settings.scan_rate, 0.1));
	robot.value(
	    "--scan-time", "S", "that the scans tell, though all beams are taken at once (default 0)",
	    number(settings.scan_time, 0));
	robot.value("--odom-rate", "HZ", "odometry a second (default 50)", number(settings.odometry_rate, 0.1));
	robot.value("--speed", "M/S", "of the robot (default 0.5; 0: it stands)", number(world.speed, 0));
	robot.value(
	    "--odom-error", "SHARE", "the standard deviation of each measured motion (default 0.02)",
	    number(world.odometry_error, 0));
	app::OptionGroup troubles(parser, "Troubles");
	troubles.value("--clutter", "N", "put N things into the building that are not on the map", count(world.clutter, 0));
	troubles.value("--people", "N", "let N people walk through the building", count(world.people, 0));
	troubles.value(
	    "--kidnap", "SECONDS", "carry the robot away each SECONDS (default 60; 0: never)",
	    number(settings.between_kidnappings, 0));
	troubles.value(
	    "--crash", "SECONDS", "kill the tracker each SECONDS (default 0: never)", number(settings.between_crashes, 0));
	troubles.value("--return", "SECONDS", "start it again after SECONDS (default 2)", number(settings.until_return, 0));
	app::OptionGroup other(parser, "Other");
	other.value(
	    "--tracker", "COMMAND", "run this, such as nav2's amcl, as the tracker (default: one that knows no map)",
	    [&](const std::string& text) { settings.tracker = text; });
	other.flag("--no-map", "leave /map to somebody else, such as nav2's map_server", settings.leaves_map);
	other.value(
	    "--log", "FILE.csv", "where the robot was at each scan, and where map -> odom of /tf says that it was",
	    [&](const std::string& text) { settings.log = text; });
	other.value(
	    "--seed", "N", "of all that is random (default 1)",
	    [&](const std::string& text) { world.seed = static_cast<unsigned>(parse_whole_number(text, 0, 4294967295)); });
	other.value(
	    "--domain", "ID", "the domain of ROS 2 (default: ROS_DOMAIN_ID, else 0)",
	    [&](const std::string& text)
	    { settings.domain = static_cast<std::uint32_t>(parse_whole_number(text, 0, live::kGreatestDomain)); });
	other.value(
	    "--namespace", "NAME", "the namespace of all topics, such as /robot1",
	    [&](const std::string& text) { settings.names.space = (text.front() == '/' ? "" : "/") + text; });
	other.help("d2s1r-live-drive " D2S1R_VERSION "\n", std::cout);
}

int run(int argc, char** argv)
{
	DriveSettings settings;
	settings.domain = live::domain_of_environment();
	std::vector<std::string> words(argv + 1, argv + argc), names;
	while (!words.empty() && words.front().rfind('-', 0) != 0 && names.size() < 3)
	{
		names.push_back(words.front());
		words.erase(words.begin());
	}
	CLI::App parser;
	app::set_up(parser, kUsage);
	add_options(parser, settings);
	if (!app::parse_words(parser, kUsage, words)) return app::kDone;
	if (names.size() < 2) app::refuse_option(kUsage.program, "MAP SECONDS", "are missing");
	settings.map = names[0];
	settings.seconds = parse_finite_number(names[1], "is not a time in s; write MAP SECONDS");
	if (names.size() > 2) settings.markers = names[2];
	if (is_tracker()) track(settings);
	TrackerProcess::words = argv;
	try
	{
		std::cout << drive::drive(settings) << std::endl;
	}
	catch (const std::exception& error)
	{
		throw app::about(settings.map, app::kBadInput, error);
	}
	return app::kDone;
}
}  // namespace

int main(int argc, char** argv)
try
{
	return run(argc, argv);
}
catch (const app::UserError& error)
{
	std::cerr << "d2s1r-live-drive: " << error.what() << '\n';
	return error.status;
}
catch (const std::exception& error)
{
	std::cerr << "d2s1r-live-drive: " << one_line(error) << '\n';
	return app::kWrongUse;
}
