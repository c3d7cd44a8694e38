// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A scan that fits two places equally well is never localized at one of them.
#include <d2s1r/localizer.h>
#include <gtest/gtest.h>
#include <mrpt/random/RandomGenerators.h>

#include <algorithm>

#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
/// A corridor of 62 x 2 m in cells of 5 cm, which equals itself turned by 180 deg, cell for cell.
Grid make_equal_corridor()
{
	constexpr int kLength = 1240, kWidth = 40, kMargin = 20, kWall = 2;  // [cells]
	Grid grid{kLength + 2 * kMargin, kWidth + 2 * kMargin, 0.05, 0, 0, {}};
	for (int y = 0; y < grid.height; y++)
		for (int x = 0; x < grid.width; x++)
		{
			const int from_side = std::min(y - kMargin, kMargin + kWidth - 1 - y);
			const int from_end = std::min(x - kMargin, kMargin + kLength - 1 - x);
			const int from_wall = std::min(from_side, from_end);
			grid.cells.push_back(from_wall < 0 ? Cell::kUnknown : (from_wall < kWall ? Cell::kOccupied : Cell::kFree));
		}
	return grid;
}

/// How many scans at these poses are localized.
int count_localized(const Grid& grid, const std::vector<mrpt::math::TPose2D>& robots, int field_of_view)
{
	const Localizer localizer(make_map(grid));
	return static_cast<int>(std::count_if(
	    robots.begin(), robots.end(),
	    [&](const mrpt::math::TPose2D& robot)
	    {
		    const auto scan = make_observation(grid, robot, laser_of(field_of_view));
		    return localizer.localize(scan).status == Status::kLocalized;
	    }));
}
}  // namespace

TEST(EqualPlacesInACorridor, AreNeverLocalizedAtOneOfThem)
{
	constexpr int kScans = 80;
	mrpt::random::CRandomGenerator random(7);
	// At the first pose the samples beside the other end cost more than what the search keeps.
	std::vector<mrpt::math::TPose2D> robots{{61.0974, 2.5687, -2.1926}};
	for (int i = 0; i < kScans; i++)
	{
		const double from_end = random.drawUniform(1.5, 12.0), across = random.drawUniform(-0.6, 0.6);
		robots.emplace_back(i % 2 == 0 ? 1 + from_end : 63 - from_end, 2 + across, random.drawUniform(-M_PI, M_PI));
	}
	EXPECT_EQ(count_localized(make_equal_corridor(), robots, 360), 0);
}

TEST(EqualPlacesOnAFloor, AreNeverLocalizedAtOneOfThem)
{
	const Grid floor = make_floor(), both = with_turned_copy(floor);
	std::vector<mrpt::math::TPose2D> robots;
	for (const auto& pose : random_poses(floor, 100, 0.2, 3))
		robots.emplace_back(pose.x - floor.origin_x, pose.y - floor.origin_y, pose.phi);
	for (const int field_of_view : {360, 180}) EXPECT_EQ(count_localized(both, robots, field_of_view), 0);
}
}  // namespace d2s1r::test
