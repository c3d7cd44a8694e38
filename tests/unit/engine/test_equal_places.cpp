// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A scan that fits two places equally well is never localized at one of them.
#include <d2s1r/localizer.h>
#include <gtest/gtest.h>
#include <mrpt/random/RandomGenerators.h>

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
}  // namespace

TEST(EqualPlaces, AreNeverLocalizedAtOneOfThem)
{
	constexpr int kScans = 80;
	const Grid grid = make_equal_corridor();
	const Localizer localizer(make_map(grid));
	mrpt::random::CRandomGenerator random(7);
	// At the first pose the samples beside the other end cost more than what the search keeps.
	std::vector<mrpt::math::TPose2D> robots{{61.0974, 2.5687, -2.1926}};
	for (int i = 0; i < kScans; i++)
	{
		const double from_end = random.drawUniform(1.5, 12.0), across = random.drawUniform(-0.6, 0.6);
		robots.emplace_back(i % 2 == 0 ? 1 + from_end : 63 - from_end, 2 + across, random.drawUniform(-M_PI, M_PI));
	}
	int localized = 0;
	for (const mrpt::math::TPose2D& robot : robots)
	{
		const Localization answer = localizer.localize(make_observation(grid, robot));
		if (answer.status == Status::kLocalized) localized++;
	}
	EXPECT_EQ(localized, 0);
}
}  // namespace d2s1r::test
