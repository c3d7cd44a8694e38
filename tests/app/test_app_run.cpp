// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// How a run goes: threads, interrupts, ground truth, progress.
#include <d2s1r/version.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <thread>

#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;
namespace fs = std::filesystem;

class AppRun : public AppTest
{
   protected:
	AppRun() { save_map(flat(), path("flat.yaml")); }

	Words words(const std::string& out, const Words& more = {}) const
	{
		Words all = {"-m", path("flat.yaml"), "-i", path("in.rawlog"), "-o", path(out)};
		all.insert(all.end(), more.begin(), more.end());
		return all;
	}

	/// The walk again and again.
	static Objects long_log(std::size_t times)
	{
		Objects log;
		const Objects once = observation_log();
		for (std::size_t i = 0; i < times; i++) log.insert(log.end(), once.begin(), once.end());
		return log;
	}

	/// frames.csv without the columns of times.
	std::vector<std::vector<std::string>> rows(const std::string& out) const
	{
		return CsvTable(path(out + "/frames.csv"), kFramesHeader).without_times();
	}

	void wait_for_frames(Process& process, const std::string& out) const
	{
		while (process.running() && growing(out, "frames.csv").value_or(0) == 0)
			std::this_thread::sleep_for(std::chrono::milliseconds(5));
	}

	/// Size of the file that is being written under another name.
	std::optional<std::uintmax_t> growing(const std::string& out, const std::string& name) const
	{
		std::error_code error;
		for (const auto& entry : fs::directory_iterator(path(out), error))
			if (entry.path().filename().string().find("-" + name) != std::string::npos) return entry.file_size(error);
		return std::nullopt;
	}
};

TEST_F(AppRun, AnyNumberOfThreadsGivesTheSameBytes)
{
	save(long_log(5), path("in.rawlog"));
	ASSERT_EQ(run(words("one", {"-q"})).status, 0);
	ASSERT_EQ(run(words("three", {"-q", "--threads", "3"})).status, 0);
	EXPECT_EQ(rows("one").size(), 5 * walk().size());
	EXPECT_EQ(rows("one"), rows("three"));
	for (const char* name : {"hypotheses.csv", "trajectory.tum", "trajectory.txt", "localized.rawlog", "map.png"})
		EXPECT_EQ(read_file(path("one/") + name), read_file(path("three/") + name)) << name;
}

TEST_F(AppRun, InterruptKeepsTheFinishedFrames)
{
	const std::size_t times = 3000;
	save(long_log(times), path("in.rawlog"));
	Process process = start(words("out", {"--threads", "2"}));
	wait_for_frames(process, "out");
	process.send(SIGINT);
	const auto result = process.wait();
	EXPECT_EQ(result.status, 130);
	const CsvTable frames(path("out/frames.csv"), kFramesHeader);
	EXPECT_GT(frames.size(), 0U);
	ASSERT_LT(frames.size(), times * walk().size());
	const std::string expected = "interrupted after " + std::to_string(frames.size()) + " of " +
	                             std::to_string(times * walk().size()) + " frames";
	EXPECT_NE(result.err.find(expected), std::string::npos) << result.err;
	EXPECT_EQ(frames.text(frames.size() - 1, "frame"), std::to_string(frames.size() - 1));
	EXPECT_EQ(load(path("out/localized.rawlog")).size(), 3 * frames.size());
	EXPECT_TRUE(fs::exists(path("out/map.png")));
	EXPECT_FALSE(growing("out", "frames.csv"));
}

TEST_F(AppRun, AnInterruptBeforeTheFirstFrameLeavesEarlierResults)
{
	save(long_log(1), path("in.rawlog"));
	ASSERT_EQ(run(words("out", {"-q"})).status, 0);
	const std::string before = read_file(path("out/frames.csv"));
	write_file(path("slow.ini"), "[coarse_search]\nspacing = 0.01\n");
	Process process = start(words("out", {"-c", path("slow.ini")}));
	while (process.running() && !growing("out", "frames.csv")) std::this_thread::yield();
	process.send(SIGTERM);
	const auto result = process.wait();
	EXPECT_EQ(result.status, 130);
	EXPECT_NE(result.err.find("interrupted before the first frame; no results are written"), std::string::npos)
	    << result.err;
	EXPECT_EQ(read_file(path("out/frames.csv")), before);
	EXPECT_FALSE(growing("out", "frames.csv"));
}

TEST_F(AppRun, ManySignalsKeepTheFinishedFrames)
{
	save(long_log(3000), path("in.rawlog"));
	Process process = start(words("out", {"--threads", "2"}));
	wait_for_frames(process, "out");
	for (const int signal : {SIGHUP, SIGHUP, SIGINT, SIGINT, SIGTERM})
	{
		process.send(signal);
		std::this_thread::sleep_for(std::chrono::milliseconds(1));
	}
	const auto result = process.wait();
	EXPECT_EQ(result.status, 130);
	EXPECT_NE(result.err.find("interrupted after"), std::string::npos) << result.err;
	EXPECT_GT(CsvTable(path("out/frames.csv"), kFramesHeader).size(), 0U);
}

TEST_F(AppRun, NohupLetsTheRunGoOn)
{
	save(long_log(300), path("in.rawlog"));
	Words command = {"nohup", RAWLOG_LOCALIZE};
	for (const auto& word : words("out", {"-q"})) command.push_back(word);
	Process process(command, folder());
	wait_for_frames(process, "out");
	process.send(SIGHUP);
	EXPECT_EQ(process.wait().status, 0);
}

TEST_F(AppRun, UnfinishedRunLeavesTheOldResultsAlone)
{
	save(observation_log(), path("in.rawlog"));
	ASSERT_EQ(run(words("out", {"-q"})).status, 0);
	const std::string before = read_file(path("out/frames.csv"));
	write_file(path("flat.yaml"), "no map");
	EXPECT_EQ(run(words("out", {"-q"})).status, 2);
	EXPECT_EQ(read_file(path("out/frames.csv")), before);
}

TEST_F(AppRun, GroundTruthOfFourOrSevenColumnsGivesTheSameAccuracy)
{
	save(observation_log(), path("in.rawlog"));
	save_truth(path("four.txt"), false);
	save_truth(path("seven.txt"), true);
	const auto accuracy = [&](const std::string& truth)
	{
		const auto result = run(words("out", {"--ground-truth", path(truth)}));
		EXPECT_EQ(result.status, 0) << result.err;
		const auto start = result.out.find("success"), end = result.out.find("first pose");
		return start < end ? result.out.substr(start, end - start) : "no accuracy in " + result.out;
	};
	const std::string four = accuracy("four.txt");
	EXPECT_NE(four.find("0.3 m, 5 deg: 12 of 12 frames (100.0 %)"), std::string::npos) << four;
	EXPECT_NE(four.find("0.2 m, 5 deg: 12 of 12 frames"), std::string::npos) << four;
	EXPECT_NE(four.find("error"), std::string::npos) << four;
	EXPECT_EQ(accuracy("seven.txt"), four);
}

TEST_F(AppRun, ItEndsWithTheFirstPoseAndHowToLookAtTheResults)
{
	save(observation_log(), path("in.rawlog"));
	const auto result = run(words("out of it", {}));
	ASSERT_EQ(result.status, 0) << result.err;
	const auto lines = lines_of(result.out);
	ASSERT_GE(lines.size(), 3U);
	EXPECT_EQ(lines[lines.size() - 3].rfind("first pose  x ", 0), 0U) << result.out;
	EXPECT_EQ(
	    lines[lines.size() - 2].rfind("written     " + path("out of it") + ": frames.csv hypotheses.csv ", 0), 0U);
	EXPECT_EQ(lines.back(), "to look     xdg-open '" + path("out of it") + "/report.html'");
}

TEST_F(AppRun, WrongPosesAndLinesWithoutAFrameAreCounted)
{
	save(observation_log(), path("in.rawlog"));
	save_truth(path("truth.txt"), false);
	auto lines = lines_of(read_file(path("truth.txt")));
	ASSERT_EQ(lines.size(), walk().size() + 1);
	lines[1] = "1600000000.0008 9 1 0";         // within 1 ms of frame 0, elsewhere
	lines[2] = "1599999990.3980 3.5 5.25 0.1";  // no frame is near, nor is the next line
	std::string text;
	for (const auto& line : lines) text += line + "\n";
	write_file(path("truth.txt"), text);
	const auto result = run(words("out", {"--ground-truth", path("truth.txt")}));
	EXPECT_NE(result.out.find("0.3 m, 5 deg: 10 of 11 frames"), std::string::npos) << result.out;
	EXPECT_NE(result.out.find("1 of 12 ground truth lines have no frame"), std::string::npos) << result.out;
}

TEST_F(AppRun, TrajectoryIsGroundTruthAlsoWithAnotherClockOrAsATable)
{
	save(observation_log(), path("in.rawlog"));
	ASSERT_EQ(run(words("first", {"-q"})).status, 0);
	const auto table_with = [&](const std::string& truth)
	{
		const auto result = run(words("out", {"--ground-truth", truth}));
		EXPECT_EQ(result.status, 0) << result.err;
		EXPECT_NE(result.out.find("0.3 m, 5 deg: 12 of 12 frames"), std::string::npos) << result.out;
		EXPECT_NE(result.out.find("0.000 m +- 0.000 m, 0.00 deg"), std::string::npos) << result.out;
		return result.out;
	};
	for (const char* name : {"first/trajectory.tum", "first/trajectory.txt", "first/frames.csv"})
		EXPECT_EQ(table_with(path(name)).find("clock"), std::string::npos) << name;
	std::string shifted;
	for (const auto& line : lines_of(read_file(path("first/trajectory.tum"))))
	{
		const auto blank = line.find(' ');
		shifted += std::to_string(std::stod(line.substr(0, blank)) + 0.05) + line.substr(blank) + "\n";
	}
	write_file(path("shifted.tum"), shifted);
	const std::string table = table_with(path("shifted.tum"));
	EXPECT_NE(table.find("the ground truth's clock is 0.050 s ahead of the log's"), std::string::npos) << table;
}

TEST_F(AppRun, AccuracyIsOfTheNearestFrameAndTellsWhichSuccessesWereLocalized)
{
	const auto accuracy = [&](const Words& more)
	{
		Words with = {"-q", "--ground-truth", path("truth.txt")};
		with.insert(with.end(), more.begin(), more.end());
		const auto result = run(words("out", with));
		EXPECT_EQ(result.status, 0) << result.err;
		return nlohmann::json::parse(read_file(path("out/summary.json")));
	};
	save(observation_log(), path("in.rawlog"));
	std::string turned = "1599999999 1 1 0\n";  // no scan is of that time
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		char line[160];
		const auto& pose = walk()[i];
		std::snprintf(
		    line, sizeof line, "%.6f %.4f %.4f %.6f\n", walk_time(i), pose.x + 0.1, pose.y, pose.phi - 2 * M_PI + 0.05);
		turned += line;
	}
	write_file(path("truth.txt"), turned);
	write_file(path("never.ini"), "[scoring]\nlocalized_above = 1\n");
	const auto sure = accuracy({}), never = accuracy({"-c", path("never.ini")});
	EXPECT_EQ(sure["ground_truth_lines_without_frame"], 1);
	EXPECT_EQ(sure["accuracy_0.3m_5deg"]["localized_successes"], 12);
	EXPECT_NEAR(sure["accuracy_0.3m_5deg"]["position_error_mean_m"].get<double>(), 0.1, 0.02);
	EXPECT_NEAR(sure["accuracy_0.3m_5deg"]["yaw_error_mean_deg"].get<double>(), 0.05 * 180 / M_PI, 0.2);
	EXPECT_LT(sure["accuracy_0.3m_5deg"]["position_error_std_m"].get<double>(), 0.02);
	EXPECT_LT(sure["accuracy_0.3m_5deg"]["yaw_error_std_deg"].get<double>(), 0.2);
	EXPECT_EQ(never["accuracy_0.3m_5deg"]["successes"], 12);
	EXPECT_EQ(never["accuracy_0.3m_5deg"]["localized_successes"], 0);

	auto second = walk_scan(5);
	second->timestamp = walk_scan(0)->timestamp + std::chrono::microseconds(600);
	save({walk_scan(0), second}, path("in.rawlog"));
	char line[160];
	std::snprintf(
	    line, sizeof line, "%.6f %.4f %.4f %.6f\n", walk_time(0) + 1e-4, walk()[0].x, walk()[0].y, walk()[0].phi);
	write_file(path("truth.txt"), line);
	EXPECT_EQ(accuracy({})["accuracy_0.3m_5deg"]["successes"], 1);
}

TEST_F(AppRun, RunJsonIsEnoughToRepeatTheRun)
{
	save(observation_log(), path("in.rawlog"));
	write_file(path("own.ini"), "[scoring]\nhypotheses = 3\n[scan]\nmax_tilt = 7.5\n");
	ASSERT_EQ(run(words("out", {"-q", "-c", path("own.ini"), "--frames", "1:9:2", "--window", "2"})).status, 0);
	const auto record = nlohmann::json::parse(read_file(path("out/run.json")));
	EXPECT_EQ(record["version"], D2S1R_VERSION);
	EXPECT_EQ(record["parameters"]["scan"]["max_tilt"], "7.5");
	ASSERT_EQ(record["map"]["files"].size(), 2U) << record["map"];
	EXPECT_EQ(record["map"]["files"][0]["bytes"], fs::file_size(path("flat.yaml")));
	EXPECT_EQ(record["map"]["files"][1]["bytes"], fs::file_size(path("flat.pgm")));
	EXPECT_EQ(record["log"]["sensor_scans"], walk().size());
	const double inside = 10 * 8;  // [m^2] walls and furniture included
	EXPECT_GT(record["map"]["free_area_m2"], 0.6 * inside);
	EXPECT_LT(record["map"]["free_area_m2"], inside);

	fs::remove(path("own.ini"));
	std::string ini;
	for (const auto& [section, values] : record["parameters"].items())
	{
		ini += "[" + section + "]\n";
		for (const auto& [name, value] : values.items()) ini += name + " = " + value.get<std::string>() + "\n";
	}
	write_file(path("again.ini"), ini);
	Words again;
	for (const auto& [name, value] : record["options"].items())
		if (name == "quiet")
			again.push_back("--quiet");
		else
			again.push_back("--" + name + "=" + value.get<std::string>());
	for (auto& word : again)
	{
		if (word.rfind("--config=", 0) == 0) word = "--config=" + path("again.ini");
		if (word.rfind("--output=", 0) == 0) word = "--output=" + path("again");
	}
	const auto result = run(again);
	ASSERT_EQ(result.status, 0) << result.err;
	EXPECT_EQ(rows("again").size(), 4U);
	EXPECT_EQ(rows("again"), rows("out"));
	EXPECT_EQ(read_file(path("again/hypotheses.csv")), read_file(path("out/hypotheses.csv")));
	const auto repeated = nlohmann::json::parse(read_file(path("again/run.json")));
	EXPECT_EQ(repeated["map"]["fingerprint"], record["map"]["fingerprint"]);
	EXPECT_EQ(repeated["parameters"], record["parameters"]);
}

TEST_F(AppRun, TerminalGetsAProgressBarWithRateAndTimeLeft)
{
	save(long_log(3), path("in.rawlog"));
	std::string command = RAWLOG_LOCALIZE;
	for (const auto& word : words("out")) command += " " + word;
	const auto result = run_program({"script", "-qec", command, "/dev/null"});
	if (result.status == 127) GTEST_SKIP() << "script is missing: install bsdutils";
	EXPECT_EQ(result.status, 0);
	for (const char* part : {"100 %", "36/36 frames", "frames/s", "s left", "[####"})
		EXPECT_NE(result.out.find(part), std::string::npos) << result.out;
	const auto narrow = run_program({"script", "-qec", "stty cols 40; " + command, "/dev/null"});
	std::string drawn = narrow.out;
	std::replace(drawn.begin(), drawn.end(), '\r', '\n');
	for (const auto& line : lines_of(drawn))
	{
		const auto end = line.find('\033');  // which lines of the table do not have
		EXPECT_TRUE(end == std::string::npos || end < 40U) << line;
	}
	EXPECT_NE(narrow.out.find("36/36 frames"), std::string::npos) << narrow.out;
	const auto quiet = run_program({"script", "-qec", command + " -q", "/dev/null"});
	EXPECT_EQ(quiet.out, "");
}
