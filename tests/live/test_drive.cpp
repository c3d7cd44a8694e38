// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// d2s1r-live beside the simulated robot that users have.
#include <mrpt/poses/CPose2D.h>

#include <optional>
#include <regex>
#include <sstream>

#include "live_test.h"

namespace d2s1r::test
{
namespace
{
const std::string kOffice = D2S1R_SOURCE_DIR "/share/d2s1r/data/office.yaml";

/// What a drive says at its end.
struct Drove
{
	int scans = 0, kidnappings = 0, seeds = 0, right = 0, poses = 0, right_poses = 0;
};

Drove parse(const std::string& line)
{
	const std::regex form(
	    "(\\d+) scans, (\\d+) times carried away, (\\d+) seeds; the tracker was right \\(1 m\\) at (\\d+) scans; "
	    "(\\d+) "
	    "poses, of which right \\(0.1 m\\) (\\d+)[^]*");
	std::smatch found;
	if (!std::regex_match(line, found, form)) throw std::runtime_error("another line: " + line);
	const auto number = [&](int i) { return std::stoi(found[static_cast<std::size_t>(i)]); };
	return {number(1), number(2), number(3), number(4), number(5), number(6)};
}

/// A row of the log of a drive.
struct LoggedScan
{
	mrpt::poses::CPose2D robot;                //!< in map
	std::optional<mrpt::poses::CPose2D> told;  //!< robot in map, by its tracker
	int kidnappings = 0, starts = 0;
};
using Logged = std::vector<LoggedScan>;

Logged read_log(const std::string& file)
{
	Logged log;
	auto lines = lines_of(read_file(file));
	lines.erase(lines.begin());
	for (const std::string& line : lines)
	{
		std::vector<std::string> fields;
		std::istringstream in(line);
		for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
		const auto pose = [&](std::size_t first)
		{
			return mrpt::poses::CPose2D(
			    std::stod(fields.at(first)), std::stod(fields.at(first + 1)),
			    mrpt::DEG2RAD(std::stod(fields.at(first + 2))));
		};
		LoggedScan scan{pose(1), {}, std::stoi(fields.at(7)), std::stoi(fields.at(8))};
		if (!fields.at(4).empty()) scan.told = pose(4);
		log.push_back(scan);
	}
	return log;
}
}  // namespace

TEST_F(LiveTest, FindsTheSimulatedRobotAndItsTrackerAgainAfterEachMishap)
{
	LiveProcess live = start_live({"--seed", "watch"});
	const auto result = run_program(
	    {D2S1R_LIVE_DRIVE,
	     kOffice,
	     "22",
	     "--domain",
	     std::to_string(test_domain()),
	     "--kidnap",
	     "14",
	     "--crash",
	     "8",
	     "--return",
	     "1",
	     "--clutter",
	     "3",
	     "--field-of-view",
	     "270",
	     "--beams",
	     "541",
	     "--scan-rate",
	     "12.5",
	     "--odom-rate",
	     "30",
	     "--odom-error",
	     "0.05"});
	EXPECT_EQ(result.status, 0) << result.err;
	const Drove drove = parse(result.out);
	EXPECT_EQ(drove.kidnappings, 1);
	EXPECT_NE(result.out.find("the tracker crashed 2 times"), std::string::npos) << result.out;
	EXPECT_GE(drove.seeds, 4) << "at the start, after two crashes, and after the robot was carried away\n" << said();
	EXPECT_GE(drove.poses, drove.scans / 3) << result.out;
	EXPECT_GE(drove.right_poses, drove.poses - 2) << result.out;
	EXPECT_GE(drove.right, drove.scans / 3) << result.out;
	stop(live);
}

TEST_F(LiveTest, TheSimulatedRobotJudgesPosesBetweenScans)
{
	LiveProcess live = start_live({"--track"});
	const auto result =
	    run_program({D2S1R_LIVE_DRIVE, kOffice, "8", "--domain", std::to_string(test_domain()), "--kidnap", "0"});
	const Drove drove = parse(result.out);
	EXPECT_GE(drove.poses, drove.scans) << "one for each reading of the odometry\n" << said();
	EXPECT_GE(drove.right_poses, drove.poses * 9 / 10) << result.out;
	EXPECT_EQ(drove.seeds, 0);
	EXPECT_GE(drove.right, drove.scans / 2) << "by map -> odom, which nobody is seeded for\n" << result.out;
	stop(live);
}

TEST_F(LiveTest, TheSimulatedRobotTakesTheSameWayWhateverIsMeasured)
{
	const auto end_of = [&](const Words& options)
	{
		Words words = {D2S1R_LIVE_DRIVE, kOffice,     "3",        "--domain", std::to_string(test_domain()),
		               "--kidnap",       "1",         "--speed",  "0",        "--log",
		               path("log.csv"),  "--tracker", "sleep 100"};
		words.insert(words.end(), options.begin(), options.end());
		EXPECT_EQ(run_program(words).status, 0);
		const Logged log = read_log(path("log.csv"));
		EXPECT_EQ(log.back().kidnappings, 2);
		return log.back().robot;
	};
	LiveProcess live = start_live({"--seed", "never"});
	const auto end = end_of({});
	EXPECT_LT(end.distanceTo(end_of({"--odom-rate", "20", "--beams", "90"})), 1e-3);
	EXPECT_GT(end.distanceTo(end_of({"--seed", "2"})), 0.1);
	const Words people = {"--people", "9"}, other = {"--people", "9", "--odom-rate", "20"};
	EXPECT_LT(end_of(people).distanceTo(end_of(other)), 1e-3) << "where people walk";
	stop(live);
}

TEST_F(LiveTest, TheSimulatedRobotLogsWhatATrackerOfSomebodyElseSays)
{
	LiveProcess live = start_live({"--track", "--map", kOffice});
	const auto result = run_program(
	    {D2S1R_LIVE_DRIVE, kOffice, "8", "--domain", std::to_string(test_domain()), "--kidnap", "0", "--no-map",
	     "--tracker", "sleep 100", "--crash", "5", "--return", "1", "--log", path("log.csv")});
	EXPECT_EQ(result.status, 0) << result.err;
	EXPECT_EQ(result.out.find("seeds"), std::string::npos) << result.out;
	const Logged log = read_log(path("log.csv"));
	EXPECT_EQ(log.back().starts, 2);
	std::size_t right = 0;
	for (const LoggedScan& scan : log) right += scan.told && scan.told->distanceTo(scan.robot) < 0.3 ? 1 : 0;
	EXPECT_GE(right, log.size() / 2) << said();
	stop(live);
}

TEST_F(LiveTest, TheSimulatedRobotRefusesWrongUse)
{
	const auto refuse = [&](const Words& words, int status, const std::string& part)
	{
		Words all = words;
		all.insert(all.begin(), D2S1R_LIVE_DRIVE);
		const auto result = run_program(all);
		EXPECT_EQ(result.status, status);
		EXPECT_EQ(result.err.rfind("d2s1r-live-drive: ", 0), 0U) << result.err;
		EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
	};
	refuse({}, 1, "MAP SECONDS: are missing");
	refuse({kOffice, "soon"}, 1, "'soon' is not a time in s; write MAP SECONDS");
	refuse({kOffice, "1", "--bems", "3"}, 1, "did you mean --beams?");
	refuse({path("none.yaml"), "1"}, 2, path("none.yaml"));
	refuse({kOffice, "1", "--log", path("none/log.csv")}, 3, path("none/log.csv"));
	refuse(
	    {kOffice, "60", "--domain", std::to_string(test_domain()), "--tracker", "false"}, 1,
	    "--tracker 'false': ended by itself with status 1; check the command");
}
}  // namespace d2s1r::test
