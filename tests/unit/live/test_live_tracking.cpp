// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A robot that LiveLocalizer follows by itself.
#include "live/live_drive.h"

using namespace d2s1r;
using namespace d2s1r::test;
using namespace d2s1r::live;

namespace
{
/// A robot without another tracker.
struct TrackedDrive : Drive
{
	TrackedDrive() : Drive(tracking())
	{
		tells_pose = false;
		begin();
		live.set_tracker_readers(0, 0);
	}

	static LiveSettings tracking()
	{
		LiveSettings settings;
		settings.track = true;
		settings.seeding = Seeding::kNever;
		return settings;
	}

	/// A reading of the odometry between two scans.
	void roll()
	{
		robot.time += kStep / 5;
		robot.move(0.01, 0.03);
		live.add_transforms(robot.odometry_transform(), false);
		update(robot.time);
	}
};

TEST(LiveTracking, TellsThePoseAtEachReadingOfTheOdometry)
{
	TrackedDrive drive;
	drive.steps(10);
	const auto at_scan = drive.live.take_tracked();
	ASSERT_TRUE(at_scan);
	EXPECT_FALSE(drive.live.take_tracked()) << "once";
	drive.roll();
	const auto between = drive.live.take_tracked();
	ASSERT_TRUE(between);
	EXPECT_EQ(between->time, drive.robot.time);
	EXPECT_EQ(between->map_frame, "map");
	EXPECT_EQ(between->odometry_frame, "odom");
	EXPECT_LT(distance_between(between->robot, drive.robot.pose), 0.1);
	EXPECT_LT(distance_between(between->odometry + drive.robot.odometry, between->robot), 1e-6);
	EXPECT_LT(distance_between(between->odometry, at_scan->odometry), 0.05);
	EXPECT_TRUE(drive.seeds.empty());
}

TEST(LiveTracking, TakesTwentyScansASecond)
{
	for (const int rate : {20, 25, 40})
	{
		TrackedDrive drive;
		const auto jitter = [](int i) { return (i % 2 == 0 ? 2 : -2) * kSecond / 1000; };
		int answers = 0;
		for (int i = 0; i < rate; i++)
		{
			drive.period = kSecond / rate + jitter(i);
			answers += drive.step(0.01, 0.03) ? 1 : 0;
		}
		EXPECT_NEAR(answers, 20, 1) << rate;
		EXPECT_LT(distance_between(drive.live.take_tracked()->robot, drive.robot.pose), 0.1);
	}
}

TEST(LiveTracking, FindsARobotThatWasCarriedAway)
{
	TrackedDrive drive;
	drive.steps(10);
	drive.robot.pose = mrpt::poses::CPose2D(poses_on_floor().at(1));
	drive.steps(20, 0, 0.05);
	const auto tracked = drive.live.take_tracked();
	ASSERT_TRUE(tracked);
	EXPECT_LT(distance_between(tracked->robot, drive.robot.pose), 0.1);
}

TEST(LiveTracking, IsSilentWithoutScansOrOdometry)
{
	TrackedDrive drive;
	EXPECT_FALSE(drive.live.take_tracked());
	drive.steps(10);
	for (int i = 0; i < 150; i++) drive.roll();
	EXPECT_FALSE(drive.live.take_tracked()) << "3 s after the last scan";
	TrackedDrive still;
	still.has_odometry = false;
	still.steps(10);
	EXPECT_FALSE(still.live.take_tracked());
}

TEST(LiveTracking, APersonsPoseWinsOnlyIfTheScansAllowIt)
{
	TrackedDrive drive;
	drive.steps(10);
	drive.live.suggest({drive.robot.time, "map"}, mrpt::poses::CPose3D(mrpt::poses::CPose2D(poses_on_floor().at(1))));
	drive.steps(20, 0, 0.05);
	EXPECT_TRUE(drive.was_told("the scans do not allow the pose"));
	EXPECT_LT(distance_between(drive.live.take_tracked()->robot, drive.robot.pose), 0.1);
	drive.live.suggest({drive.robot.time, "map"}, mrpt::poses::CPose3D(drive.robot.pose));
	drive.steps(3, 0, 0.05);
	EXPECT_TRUE(drive.was_told("the scans confirm the pose"));
	drive.live.suggest({drive.robot.time, "cellar"}, mrpt::poses::CPose3D());
	drive.step();
	EXPECT_TRUE(drive.was_told("'cellar', which is not the map's frame"));
}

TEST(LiveTracking, KnowsTheTransformThatItPublishesItself)
{
	TrackedDrive drive;
	drive.steps(3);
	EXPECT_TRUE(drive.live.is_map_to_odometry(transform_of(1, "map", "odom", {})));
	EXPECT_FALSE(drive.live.is_map_to_odometry(transform_of(1, "odom", "base_link", {})));
	EXPECT_FALSE(drive.live.is_map_to_odometry(transform_of(1, "map", "other_odom", {})));
}
}  // namespace
