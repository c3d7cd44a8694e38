// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// When scans say that a tracker is lost.
#include "ros/monitor.h"
#include "test_floor.h"

using namespace d2s1r;
using namespace d2s1r::test;

namespace
{
using mrpt::poses::CPose2D;

class Monitor : public testing::Test
{
   protected:
	WatchedScan see(const CPose2D& robot, const std::optional<CPose2D>& motion, const std::optional<CPose2D>& tracker)
	{
		const Scan scan = scan_at(world_of(make_floor()), robot.asTPose());
		return monitor_.add(localizer_, scan, localizer_.localize(scan), motion, tracker);
	}

	Localizer localizer_{make_map(make_floor())};
	TrackerMonitor monitor_;
	const CPose2D place_{poses_on_floor().at(4)};
	const CPose2D step_{0.1, 0, 0.05};
};
}  // namespace

TEST_F(Monitor, CallsATrackerLostAfterFourScansInARow)
{
	CPose2D robot = place_;
	for (int i = 1; i <= 4; i++, robot = robot + step_)
	{
		const WatchedScan watched = see(robot, step_, robot + CPose2D(0.5, 0, 0));
		EXPECT_EQ(watched.away, i);
		EXPECT_EQ(watched.verdict, i < 4 ? Verdict::kCannotTell : Verdict::kLost);
		EXPECT_NEAR(watched.distance.value(), 0.5, 0.05);
	}
	EXPECT_EQ(see(robot, step_, robot).verdict, Verdict::kFits);
	EXPECT_EQ(see(robot, CPose2D(), robot + CPose2D(2, 0, 0)).away, 1) << "counted anew";
}

TEST_F(Monitor, CallsATrackerThatLooksTheOtherWayLost)
{
	WatchedScan watched;
	for (int i = 0; i < 4; i++) watched = see(place_, CPose2D(), place_ + CPose2D(0, 0, M_PI));
	EXPECT_EQ(watched.verdict, Verdict::kLost);
	EXPECT_LT(watched.agreement.value(), -5);
}

TEST_F(Monitor, ScansThatContradictTheOdometryDoNotCount)
{
	WatchedScan watched;
	for (int i = 0; i < 8; i++)
		watched = see(CPose2D(poses_on_floor().at(i % 2 == 0 ? 4U : 0U)), CPose2D(), CPose2D(6, 4, 0));
	EXPECT_EQ(watched.consistent, 1);
	EXPECT_EQ(watched.verdict, Verdict::kCannotTell);
}

TEST_F(Monitor, CannotTellWithoutATracker)
{
	WatchedScan watched;
	for (int i = 0; i < 5; i++) watched = see(place_, CPose2D(), std::nullopt);
	EXPECT_EQ(watched.verdict, Verdict::kCannotTell);
	EXPECT_EQ(watched.consistent, 5);
	EXPECT_FALSE(watched.distance);
}

TEST_F(Monitor, RefusesSettingsThatMeanNothing)
{
	EXPECT_THROW(TrackerMonitor({0, 0.4}), std::invalid_argument);
	EXPECT_THROW(TrackerMonitor({4, 0}), std::invalid_argument);
}
