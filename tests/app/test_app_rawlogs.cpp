// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Kinds of rawlogs: actions and sensory frames, several lasers, cut short; and the stock tools on the result.
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/obs/CSensoryFrame.h>

#include "../mrpt/shell.h"
#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;

class AppRawlogs : public AppTest
{
   protected:
	AppRawlogs() { save_gridmap(flat(), path("flat.gridmap.gz")); }

	Words words(const Words& more = {}) const
	{
		Words all = {"-m", path("flat.gridmap.gz"), "-i", path("in.rawlog"), "-o", path("out")};
		all.insert(all.end(), more.begin(), more.end());
		return all;
	}

	/// Expects status 2 and one line about in.rawlog, which starts like this.
	void expect_damage(const std::string& start) const
	{
		const auto result = run(words({"-q"}));
		expect_refused(result, 2, {path("in.rawlog") + ": " + start});
		EXPECT_EQ(result.err.find("mrpt"), std::string::npos) << result.err;
		EXPECT_EQ(result.err.find("/libs/"), std::string::npos) << result.err;
	}

	/// The bytes of a log that is not compressed.
	static std::string plain(const Objects& log)
	{
		std::string bytes;
		for (const auto& object : log)
			for (const std::uint8_t byte : bytes_of(*object)) bytes += static_cast<char>(byte);
		return bytes;
	}

	CsvTable frames() const { return CsvTable(path("out/frames.csv"), kFramesHeader); }

	/// Three scans of FRONT for two of REAR, REAR first.
	static Objects two_laser_log()
	{
		Objects log;
		for (std::size_t i = 0; i < 6; i++)
		{
			if (i % 3 != 2) log.push_back(walk_scan(i, "REAR"));
			log.push_back(walk_scan(i, "FRONT"));
		}
		return log;
	}
};

TEST_F(AppRawlogs, ActionsAndSensoryFramesGiveTheSamePosesAsObservations)
{
	save(observation_log(), path("in.rawlog"));
	ASSERT_EQ(run(words({"-q"})).status, 0);
	const std::string observations = read_file(path("out/trajectory.tum"));
	save(action_log(), path("in.rawlog"));
	ASSERT_EQ(run(words({"-q"})).status, 0);
	EXPECT_EQ(read_file(path("out/trajectory.tum")), observations);
}

TEST_F(AppRawlogs, PosesStandBetweenThePairsOfAnActionLog)
{
	const Objects log = action_log();
	save(log, path("in.rawlog"));
	ASSERT_EQ(run(words({"-q"})).status, 0);
	const Objects written = load(path("out/localized.rawlog"));
	ASSERT_EQ(written.size(), 2 * log.size());
	for (std::size_t pair = 0; pair < log.size() / 2; pair++)
	{
		EXPECT_EQ(bytes_of(*written[4 * pair]), bytes_of(*log[2 * pair]));
		EXPECT_EQ(bytes_of(*written[4 * pair + 1]), bytes_of(*log[2 * pair + 1]));
		EXPECT_TRUE(std::dynamic_pointer_cast<mrpt::obs::CObservationRobotPose>(written[4 * pair + 2]));
		EXPECT_TRUE(std::dynamic_pointer_cast<mrpt::obs::CObservationOdometry>(written[4 * pair + 3]));
	}
}

TEST_F(AppRawlogs, ResultsOfAnEarlierRunAreReplaced)
{
	for (const Objects& log : {observation_log(), action_log()})
	{
		save(log, path("in.rawlog"));
		ASSERT_EQ(run(words({"-q"})).status, 0);
		const std::string once = read_file(path("out/localized.rawlog"));
		std::filesystem::rename(path("out/localized.rawlog"), path("in.rawlog"));
		ASSERT_EQ(run(words({"-q"})).status, 0);
		EXPECT_EQ(read_file(path("out/localized.rawlog")), once);
		ASSERT_EQ(run(words({"-q", "--frames", "2:3"})).status, 0);
		EXPECT_EQ(load(path("out/localized.rawlog")).size(), log.size() + 2);
	}
}

TEST_F(AppRawlogs, StockRawlogEditReadsTheResultAndTakesItApart)
{
	if (const auto why = why_not("rawlog-edit", RAWLOG_LOCALIZE); !why.empty()) GTEST_SKIP() << why;
	const auto stock = run_program({"rawlog-edit", "--version"});
	for (const Objects& log : {observation_log(), action_log()})
	{
		save(log, path("in.rawlog"));
		ASSERT_EQ(run(words({"-q"})).status, 0);
		const auto info = run_program({"rawlog-edit", "--info", "-i", path("out/localized.rawlog")});
		EXPECT_EQ(info.status, 0);
		for (const char* part : {"LASER /     12", "D2S1R /     12", "D2S1R_ODO /     12"})
			EXPECT_NE(info.out.find(part), std::string::npos) << info.out;
		const auto is_of = [&](const char* version) { return stock.out.find(version) != std::string::npos; };
		if (is_of("MRPT 2.14") || is_of("MRPT 2.15")) continue;  // it says what it removes, and writes it all
		const auto removal = run_program(
		    {"rawlog-edit", "--remove-label", "D2S1R,D2S1R_ODO", "-i", path("out/localized.rawlog"), "-o",
		     path("back.rawlog"), "-w"});
		EXPECT_EQ(removal.status, 0) << removal.err;
		const Objects back = load(path("back.rawlog"));
		ASSERT_EQ(back.size(), log.size());
		for (std::size_t i = 0; i < log.size(); i++) EXPECT_EQ(bytes_of(*back[i]), bytes_of(*log[i]));
	}
}

TEST_F(AppRawlogs, MostFrequentLaserIsUsedAndSaid)
{
	save(two_laser_log(), path("in.rawlog"));
	const auto result = run(words());
	EXPECT_EQ(result.status, 0);
	EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
	for (const char* part : {"2 lasers", "'FRONT'", "6 scans", "--sensor-label"})
		EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
	EXPECT_EQ(frames().size(), 6U);
}

TEST_F(AppRawlogs, SensorLabelChoosesTheLaser)
{
	save(two_laser_log(), path("in.rawlog"));
	const auto result = run(words({"--sensor-label", "REAR"}));
	EXPECT_EQ(result.status, 0);
	EXPECT_EQ(result.err, "");
	ASSERT_EQ(frames().size(), 4U);
	EXPECT_NEAR(frames().number(2, "timestamp"), walk_time(3), 1e-6);
}

TEST_F(AppRawlogs, TwoScansOfOneLaserInASensoryFrameAreTwoFrames)
{
	auto frame = mrpt::obs::CSensoryFrame::Create();
	for (const std::size_t i : {0U, 1U}) frame->insert(walk_scan(i));
	save({frame}, path("in.rawlog"));
	ASSERT_EQ(run(words({"-q"})).status, 0);
	EXPECT_EQ(frames().size(), 2U);
	EXPECT_EQ(load(path("out/localized.rawlog")).size(), 5U);
}

TEST_F(AppRawlogs, FramesSelectsARangeAndKeepsTheNumbers)
{
	save(observation_log(), path("in.rawlog"));
	ASSERT_EQ(run(words({"-q", "--frames", "3:5"})).status, 0);
	ASSERT_EQ(frames().size(), 2U);
	EXPECT_EQ(frames().text(0, "frame"), "3");
	EXPECT_EQ(frames().text(1, "frame"), "4");
	EXPECT_EQ(load(path("out/localized.rawlog")).size(), walk().size() + 2 * 2);
	ASSERT_EQ(run(words({"-q", "--frames", "10:"})).status, 0);
	EXPECT_EQ(frames().size(), 2U);
}

TEST_F(AppRawlogs, AStepLeavesOutTheFramesBetween)
{
	save(observation_log(), path("in.rawlog"));
	const auto result = run(words({"--frames", "2:11:4"}));
	ASSERT_EQ(result.status, 0);
	EXPECT_NE(read_file(path("out/summary.json")).find("\"selected_frames\": 3"), std::string::npos);
	ASSERT_EQ(frames().size(), 3U);
	EXPECT_EQ(frames().text(0, "frame"), "2");
	EXPECT_EQ(frames().text(1, "frame"), "6");
	EXPECT_EQ(frames().text(2, "frame"), "10");
}

TEST_F(AppRawlogs, CutRawlogKeepsTheFramesBeforeTheCut)
{
	save(observation_log(), path("whole.rawlog"));
	const std::string whole = read_file(path("whole.rawlog"));
	write_file(path("in.rawlog"), whole.substr(0, whole.size() / 2));
	const auto result = run(words({"-q"}));
	EXPECT_EQ(result.status, 2);
	EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
	const std::size_t kept = frames().size();
	EXPECT_GT(kept, 0U);
	EXPECT_LT(kept, walk().size());
	for (const auto& part : {path("in.rawlog") + ": is cut short", "the " + std::to_string(kept) + " frames"})
		EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
	EXPECT_EQ(load(path("out/localized.rawlog")).size(), 3 * kept);
}

TEST_F(AppRawlogs, RawlogWithDamagedBytesKeepsTheFramesBeforeThem)
{
	Objects log;
	for (int i = 0; i < 20; i++)
		for (const auto& object : observation_log()) log.push_back(object);
	save(log, path("whole.rawlog"));
	std::string bytes = read_file(path("whole.rawlog"));
	for (std::size_t i = 0; i < 64; i++) bytes[bytes.size() / 2 + i] = static_cast<char>(~bytes[bytes.size() / 2 + i]);
	write_file(path("in.rawlog"), bytes);
	const auto result = run(words({"-q"}));
	EXPECT_EQ(result.status, 2);
	EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
	EXPECT_GT(frames().size(), 0U);
	EXPECT_LT(frames().size(), log.size());
}

TEST_F(AppRawlogs, DamageOfAPlainRawlogIsSaidInOneLineOfOurOwn)
{
	const std::string bytes = plain(observation_log());
	std::string junk;
	for (int byte = 120; byte < 256; byte++) junk += static_cast<char>(byte);
	write_file(path("in.rawlog"), bytes + junk);
	expect_damage("is damaged after object 12; copy or record the rawlog again; the 12 frames");
	EXPECT_EQ(frames().size(), walk().size());

	const std::size_t third = plain({walk_scan(0), walk_scan(1)}).size();
	write_file(path("in.rawlog"), bytes.substr(0, third) + junk + bytes.substr(third + junk.size()));
	expect_damage("is damaged after object 2; ");
	EXPECT_EQ(frames().size(), 2U);
}

TEST_F(AppRawlogs, ObjectOfAClassThatNoModuleHasIsNoDamage)
{
	const std::string known = "mrpt::obs::CObservationOdometry", unknown = "mine::obs::CObservationHumidity";
	std::string object = plain({std::make_shared<mrpt::obs::CObservationOdometry>()});
	object.replace(object.find(known), known.size(), unknown);
	write_file(path("in.rawlog"), plain({walk_scan(0)}) + object);
	expect_damage(
	    "object 2 is of the unknown class " + unknown +
	    "; load the module that has it first (--plugins); the frame before that ");
}
