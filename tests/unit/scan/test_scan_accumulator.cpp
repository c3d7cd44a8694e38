// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/localizer.h>
#include <d2s1r/scan_accumulator.h>
#include <gtest/gtest.h>

#include "ranges/ray_caster.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;
using mrpt::poses::CPose2D;

/// A room of 8 m x 6 m, and a robot whose laser sees 90 deg from 0.2 m in front of its axis.
class TurningRobot : public testing::Test
{
   protected:
	Scan scan_at(const TPose2D& robot) const
	{
		Laser laser;
		laser.beams = 91;
		laser.aperture = 90 * M_PI / 180;
		laser.on_robot = {0.2, 0, 0, 0, 0, 0};
		return make_scan(make_observation(grid_, robot, laser), {});
	}

	/// A turn in place in steps of 15 deg, starting at `start`.
	void turn(ScanAccumulator& circle, const TPose2D& start, int steps, double odometry_error = 0) const
	{
		for (int i = 0; i <= steps; i++)
		{
			const TPose2D robot{start.x, start.y, start.phi + 15 * M_PI / 180 * i};
			circle.add(scan_at(robot), i == 0 ? CPose2D() : CPose2D(0, 0, 15 * M_PI / 180 + odometry_error));
		}
	}

	/// Greatest error of a range [m] against what a full circle sees from the sensor.
	double worst_range(const Scan& scan, const TPose2D& robot) const
	{
		const TPose2D sensor = robot + scan.sensor_on_robot;
		double worst = 0;
		for (const Beam& beam : scan.beams)
		{
			const double angle = sensor.phi + static_cast<double>(beam.angle);
			const double true_range = cast_exactly(grid_, sensor.x, sensor.y, angle, 30);
			worst = std::max(worst, std::abs(true_range - static_cast<double>(beam.range)));
		}
		return worst;
	}

	const Grid grid_ =
	    make_picture_grid(enlarge({"########", "#......#", "#......#", "#......#", "#......#", "########"}, 20), 0.05);
};
}  // namespace

TEST_F(TurningRobot, StartsAgainWhereTheOdometryIsNoMotion)
{
	for (const CPose2D& motion : {CPose2D(std::nan(""), 0, 0), CPose2D(0, 0, std::nan("")), CPose2D(1e300, 0, 0)})
	{
		ScanAccumulator circle;
		turn(circle, {3, 3, 0}, 6);
		circle.add(scan_at({3, 3, 1}), motion);
		EXPECT_EQ(circle.scan().beams.size(), scan_at({3, 3, 1}).beams.size());
		EXPECT_LT(worst_range(circle.scan(), {3, 3, 1}), 1e-3);
	}
}

TEST_F(TurningRobot, FullTurnMakesAFullCircle)
{
	ScanAccumulator circle;
	turn(circle, {3, 2.5, 0.3}, 10);
	EXPECT_FALSE(circle.complete());
	EXPECT_NEAR(circle.coverage(), 240.0 / 360, 0.05);
	EXPECT_NEAR(circle.scan().field_of_view, 240 * M_PI / 180, 0.3);

	circle.clear();
	turn(circle, {3, 2.5, 0.3}, 20);
	ASSERT_TRUE(circle.complete());
	const Scan scan = circle.scan();
	EXPECT_TRUE(scan.valid());
	EXPECT_EQ(scan.field_of_view, 2 * M_PI);
	EXPECT_GT(scan.beams.size(), 330U);
	EXPECT_LT(scan.beams.size(), 400U) << "old scans only fill what newer ones did not see";
	EXPECT_TRUE(std::is_sorted(
	    scan.beams.begin(), scan.beams.end(), [](const Beam& a, const Beam& b) { return a.angle < b.angle; }));
	EXPECT_LT(worst_range(scan, {3, 2.5, 0.3 + 300 * M_PI / 180}), 0.06) << "about a cell";
}

TEST_F(TurningRobot, NewestScanIsBelievedWhereSeveralSaw)
{
	ScanAccumulator circle;
	turn(circle, {3, 2.5, 0}, 24, M_PI / 180);
	const TPose2D robot{3, 2.5, 0};
	Scan ahead = circle.scan();
	const auto behind = [](const Beam& beam) { return std::abs(beam.angle) > 40 * M_PI / 180; };
	ahead.beams.erase(std::remove_if(ahead.beams.begin(), ahead.beams.end(), behind), ahead.beams.end());
	EXPECT_GT(ahead.beams.size(), 75U);
	EXPECT_LT(worst_range(ahead, robot), 0.06);
	EXPECT_GT(worst_range(circle.scan(), robot), 0.06) << "the oldest scan is off by 15 deg";
}

TEST_F(TurningRobot, ScansFromElsewhereAreForgotten)
{
	ScanAccumulator circle(360, 0.25);
	turn(circle, {3, 2.5, 0}, 12);
	const double before = circle.coverage();
	circle.add(scan_at({3.2, 2.5, 180 * M_PI / 180}), CPose2D(-0.2, 0, 0));
	EXPECT_GE(circle.coverage(), before - 0.02);
	circle.add(scan_at({3.4, 2.5, 180 * M_PI / 180}), CPose2D(-0.2, 0, 0));
	EXPECT_NEAR(circle.coverage(), 90.0 / 360, 0.04) << "the first places are 0.4 m away";
}

TEST_F(TurningRobot, CoarseBeamsLeaveNoHoles)
{
	Laser laser;
	laser.beams = 24;
	laser.aperture = 2 * M_PI * 23 / 24;
	ScanAccumulator circle;
	circle.add(make_scan(make_observation(grid_, {3, 2.5, 0}, laser), {}), {});
	EXPECT_TRUE(circle.complete());
	EXPECT_EQ(circle.scan().beams.size(), 24U);
}

TEST_F(TurningRobot, LasersBeforeAndBehindSeeAFullCircleTogether)
{
	const auto observation = [&](const TPose2D& robot, double x, double yaw)
	{
		Laser laser;
		laser.beams = 441;
		laser.aperture = 220 * M_PI / 180;  // 190 deg leave a gap where the robot turned and moved between the scans
		laser.on_robot = {x, 0, 0, yaw, 0, 0};
		return std::make_shared<RangeScan>(make_observation(grid_, robot, laser));
	};
	const TPose2D then{3, 2.5, 0.3}, now{3.2, 2.6, 0.5};
	const CPose2D odometry(7, -5, 2);  // of the map, in the frame of the odometry
	const std::vector<PlacedObservation> both = {
	    {observation(then, -0.2, M_PI), odometry + CPose2D(then)}, {observation(now, 0.2, 0), odometry + CPose2D(now)}};
	const Scan scan = merge_scans(both, {});
	ASSERT_TRUE(scan.valid());
	EXPECT_GT(scan.field_of_view, 345 * M_PI / 180);
	EXPECT_EQ(scan.sensor_on_robot, TPose2D(0.2, 0, 0));
	EXPECT_LT(worst_range(scan, now), 0.06);
	const Localizer localizer(make_map(grid_));
	const Localization answer = localizer.localize(both);
	ASSERT_FALSE(answer.hypotheses.empty());
	const CPose2D found = answer.best().pose;  // or on the other side of the room, which looks the same from there
	EXPECT_LT(
	    std::min(
	        std::hypot(found.x() - now.x, found.y() - now.y), std::hypot(found.x() - 8 + now.x, found.y() - 6 + now.y)),
	    0.05);
}

TEST_F(TurningRobot, ObservationsThatCannotBeUsedAreLeftOutOfAMergedScan)
{
	const auto good = std::make_shared<RangeScan>(make_observation(grid_, {3, 2.5, 0.3}));
	const auto bad = std::make_shared<RangeScan>();
	EXPECT_FALSE(merge_scans({}, {}).valid());
	EXPECT_FALSE(merge_scans({{bad, {}}}, {}).valid());
	EXPECT_EQ(merge_scans({{good, {}}, {bad, {}}}, {}).beams.size(), make_scan(*good, {}).beams.size());
	EXPECT_EQ(merge_scans({{good, {}}, {good, CPose2D(5, 0, 0)}}, {}).beams.size(), make_scan(*good, {}).beams.size());
}

TEST_F(TurningRobot, BeamsThatSawNothingStillSawNothing)
{
	Scan ahead = scan_at({3, 2.5, 0});
	for (Beam& beam : ahead.beams) beam.is_return = beam.angle < 0;
	ScanAccumulator circle;
	circle.add(ahead, {});
	circle.add(scan_at({3, 2.5, M_PI}), CPose2D(0, 0, M_PI));
	const Scan scan = circle.scan();
	const auto missing = [](const Beam& beam) { return !beam.is_return; };
	EXPECT_EQ(
	    std::count_if(scan.beams.begin(), scan.beams.end(), missing),
	    std::count_if(ahead.beams.begin(), ahead.beams.end(), missing));
}

TEST_F(TurningRobot, UnusableScanCountsForItsMotion)
{
	ScanAccumulator circle;
	circle.add(scan_at({3, 2.5, 0}), {});
	Scan broken;
	broken.invalid_because = "covered";
	circle.add(broken, CPose2D(0, 0, 60 * M_PI / 180));
	circle.add(scan_at({3, 2.5, 120 * M_PI / 180}), CPose2D(0, 0, 60 * M_PI / 180));
	EXPECT_NEAR(circle.coverage(), 180.0 / 360, 0.06);
	EXPECT_LT(worst_range(circle.scan(), {3, 2.5, 120 * M_PI / 180}), 0.06);
}

TEST_F(TurningRobot, NothingSeenIsNoScan)
{
	ScanAccumulator circle;
	EXPECT_EQ(circle.coverage(), 0);
	EXPECT_FALSE(circle.complete());
	EXPECT_FALSE(circle.scan().valid());
	EXPECT_FALSE(circle.scan().invalid_because.empty());
}

TEST_F(TurningRobot, RefusesValuesThatMakeNoSense)
{
	EXPECT_THROW(ScanAccumulator(7), std::invalid_argument);
	EXPECT_THROW(ScanAccumulator{std::numeric_limits<int>::max()}, std::invalid_argument);
	EXPECT_THROW(ScanAccumulator(360, 0), std::invalid_argument);
}

TEST(ScanAccumulator, CircleFindsThePlaceThatOneNarrowScanDoesNot)
{
	// A corner that is the same in both rooms, which differ behind the robot.
	const Grid grid = make_picture_grid(
	    enlarge(
	        {"###############", "#......#......#", "#......#......#", "#......#......#", "#......#..##..#",
	         "#.###..#..##..#", "#.............#", "###############"},
	        10),
	    0.05);
	const Localizer localizer(make_map(grid), {});
	const TPose2D robot{5.5, 2.6, M_PI / 2};
	Laser laser;
	laser.beams = 61;
	laser.aperture = 60 * M_PI / 180;
	laser.max_range = 8;
	ScanAccumulator circle;
	Scan scan;
	for (int i = 0; i <= 24; i++)
	{
		scan = make_scan(make_observation(grid, {robot.x, robot.y, robot.phi + i * 15 * M_PI / 180}, laser), {});
		circle.add(scan, i == 0 ? CPose2D() : CPose2D(0, 0, 15 * M_PI / 180));
	}
	EXPECT_NE(localizer.localize(scan).status, Status::kLocalized);
	const Localization result = localizer.localize(circle.scan());
	ASSERT_FALSE(result.hypotheses.empty());
	EXPECT_LT(std::hypot(result.best().pose.x() - robot.x, result.best().pose.y() - robot.y), 0.1);
}
}  // namespace d2s1r::test
