// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// When the tracker of a running robot is told where it is, with times that the tests say.
#include "live/live_drive.h"

using namespace d2s1r;
using namespace d2s1r::test;
using namespace d2s1r::live;

TEST(LiveLocalizer, FindsTheRobotAndTellsItsTrackerOnce)
{
	Drive drive;
	drive.begin();
	drive.steps(20);
	ASSERT_EQ(drive.seeds.size(), 1U);
	const auto& [seed, truth] = drive.seeds.front();
	EXPECT_LT(distance_between(seed.pose, truth), 0.1);
	EXPECT_EQ(seed.frame, "map");
	EXPECT_GE(seed.covariance(0, 0), 0.3 * 0.3) << "inflated: a tracker must be able to move";
	EXPECT_GE(seed.covariance(2, 2), 0.1 * 0.1);
	EXPECT_EQ(drive.summary(), "localized, and the tracker fits");
	EXPECT_TRUE(drive.was_told("found /scan of 'laser' at x 0.200"));
	EXPECT_EQ(drive.live.indices_built(), 1);
}

TEST(LiveLocalizer, TellsNothingByFewerScansThanItWasAskedFor)
{
	Drive drive;
	drive.begin();
	drive.steps(3);
	EXPECT_TRUE(drive.seeds.empty());
	drive.step();
	EXPECT_EQ(drive.seeds.size(), 1U);
}

/// A killed tracker's reader of seeds stays until its lease has run out, and its last pose would still fit.
TEST(LiveLocalizer, SeedsATrackerThatWasKilledAndStartedAgain)
{
	for (const Seeding seeding : {Seeding::kOnce, Seeding::kWatch})
		for (const int seconds : {2, 6, 15})
		{
			Drive drive(watching(seeding));
			drive.begin();
			drive.steps(40);
			int ever = 1;
			for (int crash = 0; crash < 3; crash++)
			{
				const std::size_t before = drive.seeds.size();
				drive.tracker = {};         // it says nothing any more
				constexpr int kLease = 10;  // [s]
				drive.steps(20);            // 2 s
				drive.wait(std::min(seconds, kLease) - 2);
				if (seconds > kLease) drive.live.set_tracker_readers(0, ever);
				drive.wait(std::max(0, seconds - kLease));
				EXPECT_EQ(drive.seeds.size(), before) << "there is nobody to tell";
				drive.live.set_tracker_readers(seconds < kLease ? 2 : 1, ++ever);
				drive.steps(10);
				ASSERT_EQ(drive.seeds.size(), before + 1) << "within a second, after " << seconds << " s";
				const auto& [seed, truth] = drive.seeds.back();
				EXPECT_LT(distance_between(seed.pose, truth), 0.1);
				drive.wait(kLease);
				drive.live.set_tracker_readers(1, ever);
				drive.wait(5);
				EXPECT_EQ(drive.seeds.size(), before + 1) << "it took the seed";
			}
		}
}

TEST(LiveLocalizer, LeavesATrackerAloneWhenSomebodyElseReadsSeeds)
{
	Drive drive;
	drive.begin();
	drive.steps(40);
	ASSERT_EQ(drive.seeds.size(), 1U);
	drive.live.set_tracker_readers(2, 2);
	drive.steps(50);
	EXPECT_EQ(drive.seeds.size(), 1U) << "the tracker's pose fits";
}

TEST(LiveLocalizer, NeverSeedsWhatIsAmbiguous)
{
	// Two rooms that are alike: nothing tells in which of them the robot is.
	const Grid twins = make_building(
	    {"#################", "#.......#.......#", "#.......#.......#", "#..##...#..##...#", "#.......#.......#",
	     "#......##......##", "#.......#.......#", "#################"});
	Drive drive(watching(), twins);
	drive.robot.pose = mrpt::poses::CPose2D(2.9, 1.3, 0.4);
	drive.begin();
	for (int i = 0; i < 40; i++)
	{
		const auto answer = drive.step(0.0, 0.1);
		ASSERT_TRUE(answer);
		EXPECT_NE(answer->localization.status, Status::kLocalized);
	}
	EXPECT_TRUE(drive.seeds.empty());
	EXPECT_EQ(drive.summary(), "several places explain the scan");
}

TEST(LiveLocalizer, SeedsATrackerThatStartsLater)
{
	Drive drive;
	drive.begin();
	drive.live.set_tracker_readers(0, 0);
	Drive late;
	late.add_map(late.grid);
	late.live.add_transforms(late.robot.laser_transform(), true);
	late.steps(20);
	EXPECT_TRUE(late.seeds.empty()) << "nobody would hear it";
	EXPECT_EQ(late.summary(), "localized");
	late.live.set_tracker_readers(1, 1);
	late.step();
	ASSERT_EQ(late.seeds.size(), 1U);
	late.steps(20);
	EXPECT_EQ(late.seeds.size(), 1U);
	late.live.set_tracker_readers(0, 1);  // killed and started again
	late.tracker = {};
	late.steps(10);
	late.live.set_tracker_readers(1, 2);
	late.steps(10);
	EXPECT_EQ(late.seeds.size(), 2U);
}

TEST(LiveLocalizer, RepeatsASeedThreeTimesAndThenTellsAnError)
{
	Drive drive;
	drive.takes_seeds = false;
	drive.tracker.map_to_odometry = mrpt::poses::CPose2D(1, 1, 0);
	drive.begin();
	drive.steps(150, 0, 0);
	EXPECT_EQ(drive.seeds.size(), 4U);
	EXPECT_EQ(drive.live.status(drive.robot.time).level, LiveStatus::Level::kError);
	EXPECT_NE(drive.summary().find("told 4 times"), std::string::npos) << drive.summary();
	drive.takes_seeds = true;
	drive.live.request();
	drive.steps(5, 0, 0);
	EXPECT_EQ(drive.seeds.size(), 5U) << "somebody asked";
	EXPECT_EQ(drive.summary(), "localized, and the tracker fits");
}

TEST(LiveLocalizer, TellsThatNoPoseOfTheTrackerAnswers)
{
	Drive drive;
	drive.tells_pose = false;
	drive.begin();
	drive.steps(150, 0, 0.02);
	EXPECT_EQ(drive.seeds.size(), 4U);
	EXPECT_NE(drive.summary().find("no pose of it says that it took it"), std::string::npos) << drive.summary();
}

TEST(LiveLocalizer, SaysThatATrackerIsLostAndSeedsItOnlyIfAsked)
{
	for (const Seeding seeding : {Seeding::kOnce, Seeding::kWatch, Seeding::kNever})
	{
		Drive drive(watching(seeding));
		drive.begin();
		drive.tracker.map_to_odometry = drive.robot.pose;
		drive.steps(30, 0, 0.02);
		EXPECT_EQ(drive.summary(), "localized, and the tracker fits");
		EXPECT_TRUE(drive.seeds.empty()) << "it knows already";
		drive.robot.pose = mrpt::poses::CPose2D(poses_on_floor().at(6));  // carried there
		drive.steps(5, 0, 0.02);
		if (seeding == Seeding::kWatch)
		{
			ASSERT_EQ(drive.seeds.size(), 1U);
			EXPECT_LT(distance_between(drive.seeds.front().first.pose, drive.seeds.front().second), 0.1);
			drive.steps(5, 0, 0.02);
			EXPECT_EQ(drive.summary(), "localized, and the tracker fits");
			continue;
		}
		EXPECT_TRUE(drive.seeds.empty());
		EXPECT_EQ(drive.live.status(drive.robot.time).level, LiveStatus::Level::kWarning);
		EXPECT_EQ(drive.summary().find("the tracker is lost: "), 0U) << drive.summary();
	}
}

TEST(LiveLocalizer, ReadsTheTrackersPoseFromTransforms)
{
	Drive drive(watching());
	drive.tells_pose = false;
	drive.begin();
	drive.tracker.map_to_odometry = mrpt::poses::CPose2D(5, 1, 1);
	for (int i = 0; i < 10; i++)
	{
		const mrpt::poses::CPose3D pose(*drive.tracker.map_to_odometry);
		drive.live.add_transforms({transform_of(drive.robot.time + kSecond, "map", "odom", pose)}, false);
		drive.step(0, 0.02);
	}
	EXPECT_EQ(drive.seeds.size(), 1U) << drive.summary();
}

TEST(LiveLocalizer, TellsThatATrackersPoseIsInAnotherFrame)
{
	Drive drive;
	drive.begin();
	drive.live.add_tracker_pose({drive.robot.time, "other"}, mrpt::poses::CPose3D());
	drive.step();
	EXPECT_TRUE(drive.was_told("the tracker's pose is in 'other', which is not the map's frame"));
}
