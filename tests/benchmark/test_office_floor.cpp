// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "map/free_cells.h"
#include "office_floor.h"

namespace d2s1r::benchmark
{
namespace
{
TEST(OfficeFloor, IsTheSameForTheSameSeed)
{
	const Grid floor = make_office_floor(1000, 0.05, 1);
	EXPECT_EQ(make_office_floor(1000, 0.05, 1).cells, floor.cells);
	EXPECT_NE(make_office_floor(1000, 0.05, 2).cells, floor.cells);
}

TEST(OfficeFloor, IsMostlyFreeAndConnected)
{
	for (const double area : {1000.0, 4000.0})
	{
		const Grid floor = make_office_floor(area, 0.1, 3);
		const double free = static_cast<double>(find_free_cells(floor, {}).size());
		EXPECT_GT(free * 0.01, 0.6 * area);
		EXPECT_LT(free * 0.01, 0.95 * area);
		EXPECT_GT(static_cast<double>(find_free_cells(floor, {true, 0}).size()), 0.9 * free);
	}
}
}  // namespace
}  // namespace d2s1r::benchmark
