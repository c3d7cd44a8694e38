// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// rawlog-localize --check: what scans say about a tracker afterwards.
#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>

#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;

namespace
{
constexpr const char* kHeader =
    "frame,timestamp,verdict,tracker_x,tracker_y,tracker_phi,distance,turn,agreement,consistent,away";
constexpr std::size_t kJump = 5;  //!< [-] first frame at which the tracker is elsewhere
constexpr double kOff = 1.0;      //!< [m]
}  // namespace

class AppCheck : public AppTest
{
   protected:
	void SetUp() override
	{
		save_map(flat(), path("flat.yaml"));
		save(observation_log(), path("in.rawlog"));
	}

	/// Writes what the tracker told: the truth at every `step`th scan, but kOff to the left from scan kJump on.
	void save_tracker(std::size_t step = 1) const
	{
		std::ofstream file(path("tracker.txt"));
		for (std::size_t i = 0; i < walk().size(); i += step)
			file << std::to_string(walk_time(i)) << ' ' << walk()[i].x << ' ' << walk()[i].y + (i < kJump ? 0 : kOff)
			     << ' ' << walk()[i].phi << '\n';
	}

	CsvTable check(const Words& more = {}) const
	{
		Words words = {"-q",        "-m",      path("flat.yaml"),  "-i", path("in.rawlog"), "-o",
		               path("out"), "--check", path("tracker.txt")};
		words.insert(words.end(), more.begin(), more.end());
		const auto result = run(words);
		EXPECT_EQ(result.status, 0) << result.err;
		return {folder() / "out" / "check.csv", kHeader};
	}

	/// Expects that the tracker fits until it jumps, and is lost from its `scans`th frame elsewhere on.
	static void expect_lost_after_jump(const CsvTable& table, std::size_t scans)
	{
		ASSERT_EQ(table.size(), walk().size());
		for (std::size_t i = 0; i < table.size(); i++)
		{
			const std::string expected = i < kJump ? "fits" : i + 1 < kJump + scans ? "cannot tell" : "lost";
			EXPECT_EQ(table.text(i, "verdict"), expected) << i;
			EXPECT_NEAR(table.number(i, "distance"), i < kJump ? 0 : kOff, 0.1) << i;
		}
	}
};

TEST_F(AppCheck, ATrackerThatJumpsIsLostFourScansLater)
{
	save_tracker();
	expect_lost_after_jump(check(), 4);
	const auto summary = nlohmann::json::parse(read_file(path("out/summary.json")));
	EXPECT_EQ(summary["tracker"]["fits"], kJump);
	EXPECT_EQ(summary["tracker"]["lost"], walk().size() - kJump - 3);
	EXPECT_NEAR(summary["tracker"]["first_lost_at"].get<double>(), walk_time(kJump + 3), 1e-6);
	expect_lost_after_jump(check({"--watch", "2,0.6"}), 2);
	EXPECT_EQ(check({"--watch", "2,1.5"}).text(walk().size() - 1, "verdict"), "fits");
}

TEST_F(AppCheck, TheOdometryMovesOnWhatTheTrackerToldBefore)
{
	save(action_log(), path("in.rawlog"));
	save_tracker(5);  // at scans 0, 5 and 10
	expect_lost_after_jump(check(), 4);
}

TEST_F(AppCheck, ATrackerThatIsSilentIsNotLost)
{
	std::ofstream(path("tracker.txt")) << std::to_string(walk_time(walk().size() - 1) + 100) << " 0 0 0\n";
	const CsvTable table = check();
	for (std::size_t i = 0; i < table.size(); i++)
	{
		EXPECT_EQ(table.text(i, "verdict"), "cannot tell");
		EXPECT_EQ(table.text(i, "tracker_x"), "");
	}
}

TEST_F(AppCheck, TheStreamTellsTheVerdicts)
{
	save_tracker();
	const auto result =
	    run({"-m", path("flat.yaml"), "-i", path("in.rawlog"), "--stream", "--check", path("tracker.txt")});
	ASSERT_EQ(result.status, 0) << result.err;
	const auto lines = lines_of(result.out);
	ASSERT_EQ(lines.size(), walk().size());
	EXPECT_EQ(nlohmann::json::parse(lines.front())["tracker"]["verdict"], "fits");
	EXPECT_EQ(nlohmann::json::parse(lines.back())["tracker"]["verdict"], "lost");
}

TEST_F(AppCheck, WhatMakesNoSenseIsRefused)
{
	save_tracker();
	const Words good = {"-m", path("flat.yaml"), "-i", path("in.rawlog"), "-o", path("out")};
	const auto refused = [&](const Words& more, int status, const Words& parts)
	{
		Words words = good;
		words.insert(words.end(), more.begin(), more.end());
		expect_refusal(words, status, parts);
	};
	refused({"--check", path("none.txt")}, 2, {"none.txt: cannot be opened"});
	refused({"--check", "topic:/amcl_pose"}, 2, {"is no recording of ROS"});
	refused({"--watch", "4,0.4"}, 1, {"--watch", "--check"});
	for (const char* watch : {"0,0.4", "1.5,0.4", "4,0", "4", "1e9,1"})
		refused({"--check", path("tracker.txt"), "--watch", watch}, 1, {"--watch", watch});
	refused({"--check", path("tracker.txt"), "--diagnose"}, 1, {"--check", "--diagnose"});
	refused({"--check", path("tracker.txt"), "-m", path("flat.yaml")}, 1, {"--check", "several maps"});
}
