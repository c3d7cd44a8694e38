// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/robot_motion.h"

#include <gtest/gtest.h>
#include <mrpt/obs/CObservationOdometry.h>

using namespace d2s1r;
using namespace d2s1r::app;

namespace
{
logs::RawlogObject odometry(double time, double x)
{
	auto reading = mrpt::obs::CObservationOdometry::Create();
	reading->timestamp = logs::from_seconds(time);
	reading->odometry = mrpt::poses::CPose2D(x, 0, 0);
	return logs::to_rawlog_object(reading);
}
}  // namespace

TEST(RobotMotion, TellsThePosesAroundASweepByItsStamp)
{
	RobotMotion motion;
	EXPECT_TRUE(motion.covers(1000)) << "nobody waits for odometry that a log does not have";
	for (int i = 0; i < 20; i++) motion.add(odometry(1000 + 0.1 * i, i));
	EXPECT_TRUE(motion.covers(1001.85));
	EXPECT_FALSE(motion.covers(1001.95));
	const auto poses = motion.around(1001, 0, 0.15);
	ASSERT_GE(poses.size(), 3U);
	EXPECT_LE(poses.front().time, 0);
	EXPECT_GE(poses.back().time, 0.15);
	for (const StampedPose& pose : poses) EXPECT_NEAR(pose.robot.x, 10 + 10 * pose.time, 1e-4);
	EXPECT_LT(poses.size(), 8U);
	motion.add_scan(1003);
	EXPECT_TRUE(motion.covers(1001.95)) << "odometry has ended";
}

TEST(RobotMotion, IncrementsEndAtTheNextScan)
{
	RobotMotion motion;
	for (int i = 0; i < 3; i++)
	{
		logs::RawlogObject object;
		object.increment = mrpt::poses::CPose2D(0.5, 0, 0);
		motion.add(object);
		motion.add_scan(1000 + i);
	}
	const auto poses = motion.around(1001, 0, 0.2);
	ASSERT_EQ(poses.size(), 3U);
	EXPECT_NEAR(poses[1].time, 0, 1e-6);
	EXPECT_NEAR(poses[2].robot.x - poses[1].robot.x, 0.5, 1e-9);
}

TEST(RobotMotion, ForgetsWhatIsOldAndAClockThatWasSetBack)
{
	RobotMotion motion;
	for (int i = 0; i < 1000; i++) motion.add(odometry(1000 + i, i));
	EXPECT_LT(motion.around(1999, -100, 0).size(), 10U);
	motion.add(odometry(1500, 7));
	EXPECT_FALSE(motion.covers(1999));
}
