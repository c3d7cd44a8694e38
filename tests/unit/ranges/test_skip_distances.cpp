// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

#include "ranges/skip_distances.h"

namespace d2s1r::test
{
TEST(Clearances, AreChebyshevDistancesToAnotherClassOrTheMargin)
{
	constexpr int kMost = 6;
	std::mt19937 random(3);
	for (const auto& [width, height] : {std::pair{3, 3}, {3, 9}, {9, 3}, {40, 30}, {70, 25}})
	{
		AlignedBytes classes(static_cast<std::size_t>(width * height), 1);
		for (std::size_t i = 0; i < classes.size() / 60; i++)
			classes[random() % classes.size()] = static_cast<std::uint8_t>(random() % 3);
		const auto class_at = [&, w = width](int x, int y) { return classes[static_cast<std::size_t>(y * w + x)]; };
		const auto is_margin = [w = width, h = height](int x, int y)
		{ return x == 0 || y == 0 || x == w - 1 || y == h - 1; };
		const std::vector<std::uint8_t> found = skip_distances(classes, width, kMost);
		ASSERT_EQ(found.size(), classes.size() + kGatherOverrun);
		for (int y = 0; y < height; y++)
			for (int x = 0; x < width; x++)
			{
				int expected = is_margin(x, y) ? 0 : kMost;
				for (int v = 0; v < height; v++)
					for (int u = 0; u < width; u++)
						if (is_margin(u, v) || class_at(u, v) != class_at(x, y))
							expected = std::min(expected, std::max(std::abs(u - x), std::abs(v - y)));
				ASSERT_EQ(found[static_cast<std::size_t>(y * width + x)], expected) << x << " " << y;
			}
	}
}

TEST(SkipMap, ASensorMayStandInFreeSpaceAndALittleBeyondItsBorder)
{
	// 2 x 2 m from (-1, -1) m: free for x < 0, unknown for x > 0, and for y > 0 with a wall between them
	const auto grid_with_wall_at = [](int wall)
	{
		Grid grid;
		grid.width = grid.height = 40;
		grid.cell_size = 0.05;
		grid.origin_x = grid.origin_y = -1;
		for (int i = 0; i < 40 * 40; i++)
		{
			const int column = i % 40;
			const bool walled = i >= 20 * 40 && column >= wall && column < 22;
			grid.cells.push_back(walled ? Cell::kOccupied : column < wall ? Cell::kFree : Cell::kUnknown);
		}
		return grid;
	};
	const SkipMap map = make_skip_map(grid_with_wall_at(20), grid_with_wall_at(21), {});
	const auto may_stand = [&](double x, double y, int reading) { return map.may_stand(x, y, 0.3, reading); };
	EXPECT_TRUE(may_stand(-0.5, 0.5, 0));
	EXPECT_TRUE(may_stand(0.29, -0.5, 0));
	EXPECT_FALSE(may_stand(0.31, -0.5, 0));
	EXPECT_FALSE(may_stand(0.02, 0.5, 0)) << "in the wall";
	EXPECT_TRUE(may_stand(0.02, 0.5, 1)) << "its surface is deeper";
	EXPECT_FALSE(may_stand(0.15, 0.5, 0)) << "behind the wall";
	EXPECT_FALSE(may_stand(-1.01, 0, 0)) << "beyond the grid";
	EXPECT_FALSE(may_stand(-0.5, 1.01, 0));
	EXPECT_FALSE(may_stand(NAN, 0, 0));
	EXPECT_FALSE(may_stand(0, INFINITY, 0));
}
}  // namespace d2s1r::test
