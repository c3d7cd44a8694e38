// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// How much of a scan another one shows again.
#include <gtest/gtest.h>

#include <cmath>

#include "frames/shared_surface.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;

/// A scan from the middle of a room that is `width` [m] wide in x and in y.
Scan scan_in_room(double width, const TPose2D& robot, double field_of_view = 2 * M_PI)
{
	Scan scan;
	scan.field_of_view = field_of_view;
	for (int i = -180; i < 180; i++)
	{
		const double angle = i * M_PI / 180, in_room = angle + robot.phi;
		if (std::abs(angle) > field_of_view / 2) continue;
		const double c = std::cos(in_room), s = std::sin(in_room);
		const double in_x = ((c > 0 ? width : -width) / 2 - robot.x) / c;
		const double in_y = ((s > 0 ? width : -width) / 2 - robot.y) / s;
		scan.beams.push_back(
		    {static_cast<float>(angle), static_cast<float>(std::min(std::abs(in_x), std::abs(in_y))), true});
	}
	return scan;
}

/// The share of a scan that another one shows. \param robot of `scan`, in the robot frame of `other`
double share_of(const Scan& scan, const Scan& other, const TPose2D& robot)
{
	ShownSurface shown;
	shown.add(other, {});
	return shown.share(scan, robot);
}

/// The share of a second scan of a robot that has moved.
double seen_again(double width, const TPose2D& motion, double field_of_view = 2 * M_PI)
{
	return share_of(scan_in_room(width, motion, field_of_view), scan_in_room(width, {}, field_of_view), motion);
}
}  // namespace

TEST(SharedSurface, IsAllOfTheSameScan)
{
	EXPECT_EQ(seen_again(4, {}), 1);
	EXPECT_EQ(seen_again(40, {}), 1) << "its beams are 35 cm apart";
}

TEST(SharedSurface, IsAllWhereARobotTurnsOrMovesInARoom)
{
	EXPECT_EQ(seen_again(4, {0, 0, 1}), 1);
	EXPECT_EQ(seen_again(4, {1, -0.5, -2}), 1);
}

TEST(SharedSurface, IsWhatTheViewsOfATurningRobotShare)
{
	EXPECT_NEAR(seen_again(4, {0, 0, M_PI / 2}, M_PI), 0.5, 0.1);
	EXPECT_NEAR(seen_again(4, {0, 0, M_PI}, M_PI), 0, 0.1);
}

TEST(SharedSurface, IsNoneOfAnotherRoom)
{
	EXPECT_NEAR(share_of(scan_in_room(4, {}), scan_in_room(4, {}), {10, 0, 0}), 0, 0.1);
}

TEST(SharedSurface, AllowsForErrorsOfTheMotionThatGrowWithTheRange)
{
	const auto off_by = [](double width, double yaw) {
		return share_of(scan_in_room(width, {}), scan_in_room(width, {}), {0, 0, yaw});
	};
	EXPECT_EQ(off_by(30, 0.02), 1);
	EXPECT_LT(off_by(30, 0.1), 0.9);
}

TEST(SharedSurface, SeesWhereTheLaserOfEachScanIs)
{
	Scan first = scan_in_room(4, {}), second = scan_in_room(4, {0.5, 0, 1});
	second.sensor_on_robot = {0.3, 0, 0.5};
	const TPose2D robot = TPose2D{0.5, 0, 1} + (TPose2D() - second.sensor_on_robot);
	EXPECT_EQ(share_of(second, first, robot), 1);
	EXPECT_LT(share_of(second, first, {}), 0.9);
}

TEST(SharedSurface, OfAScanWithoutReturnsIsAll)
{
	Scan empty;
	empty.beams = {{0, 5, false}};
	EXPECT_EQ(share_of(empty, scan_in_room(4, {}), {}), 1);
	EXPECT_EQ(share_of(scan_in_room(4, {}), empty, {}), 0);
}

TEST(SharedSurface, ARoomThatANarrowViewRoamsIsRemembered)
{
	ShownSurface shown;
	const auto fresh_in = [&](int scans)
	{
		double sum = 0;
		for (int i = 0; i < scans; i++)
		{
			const TPose2D robot{std::sin(0.013 * i), std::cos(0.05 * i), 0.07 * i};
			const Scan scan = scan_in_room(4, robot, M_PI / 2);
			sum += 1 - shown.share(scan, robot);
			shown.add(scan, robot);
		}
		return sum;
	};
	EXPECT_GT(fresh_in(300), 2) << "four walls";
	EXPECT_LT(fresh_in(300), 0.5) << "all of it was shown before";
}

TEST(SharedSurface, AWayShowsAsMuchWhateverTheRateOfScans)
{
	const auto fresh_on_way = [](double step)
	{
		ShownSurface shown;
		double sum = 0;
		for (double way = 0; way < 12; way += step)
		{
			const TPose2D robot{way, 0, 0};  // along a row of three rooms
			const Scan scan = scan_in_room(4, {std::fmod(way, 4) - 1.99, 0, 0});
			sum += 1 - shown.share(scan, robot);
			shown.add(scan, robot);
		}
		return sum;
	};
	EXPECT_NEAR(fresh_on_way(0.5), fresh_on_way(0.1), 0.3);
	EXPECT_GT(fresh_on_way(0.1), 1.5);
	EXPECT_LT(fresh_on_way(0.1), 4);
}
}  // namespace d2s1r::test
