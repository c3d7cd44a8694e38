// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// rawlog-localize --track: where a Tracker says that the robot is.
#include <nlohmann/json.hpp>

#include <cmath>

#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;

namespace
{
constexpr const char* kTrackHeader =
    "frame,timestamp,status,x,y,phi,std_x,std_y,std_phi,confidence,hypotheses,relative_entropy,retrieval_ms,"
    "registration_ms,refinement_ms,total_ms,cov_xx,cov_xy,cov_xphi,cov_yy,cov_yphi,cov_phiphi,note,map";
}

class AppTrack : public AppTest
{
   protected:
	void SetUp() override
	{
		save_map(flat(), path("flat.yaml"));
		save(action_log(), path("in.rawlog"));
	}

	ProcessResult track(const Words& more = {})
	{
		Words words = {"-m", path("flat.yaml"), "-i", path("in.rawlog"), "-o", path("out"), "--track"};
		words.insert(words.end(), more.begin(), more.end());
		const auto result = run(words);
		EXPECT_EQ(result.status, 0) << result.err;
		return result;
	}

	void expect_on_walk()
	{
		const CsvTable tracked(folder() / "out/track.csv", kTrackHeader);
		ASSERT_EQ(tracked.size(), walk().size());
		for (std::size_t i = 0; i < tracked.size(); i++)
		{
			EXPECT_EQ(tracked.text(i, "status"), "localized") << i;
			EXPECT_LT(std::hypot(tracked.number(i, "x") - walk()[i].x, tracked.number(i, "y") - walk()[i].y), 0.1) << i;
		}
		EXPECT_EQ(lines_of(read_file(folder() / "out/track.tum")).size(), walk().size());
	}
};

TEST_F(AppTrack, FollowsTheWalk)
{
	save_truth(path("truth.txt"), false);
	const auto result = track({"--ground-truth", path("truth.txt")});
	expect_on_walk();
	EXPECT_NE(result.out.find("tracked"), std::string::npos) << result.out;
	EXPECT_NE(result.out.find("track.csv"), std::string::npos) << result.out;
	const auto summary = nlohmann::json::parse(read_file(path("out/summary.json")));
	EXPECT_EQ(summary["tracked"]["localized"], walk().size());
	EXPECT_EQ(summary["tracked"]["successes_0.3m_5deg"], walk().size());
}

TEST_F(AppTrack, HoldsThePoseThroughScansThatCannotBeUsed)
{
	save(covered_laser_log(), path("in.rawlog"));
	track();
	const CsvTable tracked(folder() / "out/track.csv", kTrackHeader);
	ASSERT_EQ(tracked.size(), walk().size());
	EXPECT_NE(tracked.text(4, "note"), "");
	EXPECT_GT(tracked.number(4, "std_x"), tracked.number(2, "std_x"));
	EXPECT_EQ(tracked.text(5, "status"), "localized");
}

TEST_F(AppTrack, TheResultsDoNotDependOnThreads)
{
	const auto poses = [&](const char* threads)
	{
		track({"--threads", threads});
		return read_file(path("out/track.tum"));
	};
	EXPECT_EQ(poses("1"), poses("3"));
}

TEST_F(AppTrack, TheStreamTellsIt)
{
	const auto result = run({"-m", path("flat.yaml"), "-i", path("in.rawlog"), "--stream", "--track"});
	ASSERT_EQ(result.status, 0) << result.err;
	const auto line = nlohmann::json::parse(lines_of(result.out).back());
	EXPECT_EQ(line["tracked"]["status"], "localized");
	EXPECT_NEAR(line["tracked"]["x"].get<double>(), walk().back().x, 0.1);
}

TEST_F(AppTrack, NeedsTheDefaultMethod)
{
	write_file(path("paper.ini"), "[localizer]\nmethod = paper\n");
	expect_refusal(
	    {"-m", path("flat.yaml"), "-i", path("in.rawlog"), "-o", path("out"), "--track", "-c", path("paper.ini")}, 1,
	    {"--track"});
}
