// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "map/free_cells.h"
#include "portable_simd.h"
#include "ranges/range_sweep.h"
#include "ranges/ray_caster.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
/// Returns the ranges [units], by direction, then by cell.
std::vector<std::uint16_t> sweep_all(
    const Grid& grid, const std::vector<CellIndex>& cells, int directions, double max_range)
{
	std::vector<std::uint16_t> swept;
	RangeSweep{grid}(
	    cells, directions, max_range,
	    [&](int direction, const SweptRanges& ranges)
	    {
		    EXPECT_EQ(static_cast<std::size_t>(direction) * cells.size(), swept.size());
		    for (std::size_t i = 0; i < cells.size(); i++) swept.push_back(ranges[i]);
	    });
	return swept;
}

/// Offices and a corridor, 160 x 120 cells, some clutter, unknown surroundings.
Grid make_floor(unsigned seed)
{
	Grid grid = make_picture_grid(
	    enlarge(
	        {"????????????????",  //
	         "?....?...?.....?",  //
	         "?..............?",  //
	         "?....?...?.....?",  //
	         "???.????.???.???",  //
	         "?..............?",  //
	         "?..............?",  //
	         "??.??.?????.????",  //
	         "?....?.........?",  //
	         "?....?.........?",  //
	         "?....?.........?",  //
	         "????????????????"},
	        10),
	    0.05, -3, 1);
	std::mt19937 random(seed);
	for (int y = 1; y + 1 < grid.height; y++)
		for (int x = 1; x + 1 < grid.width; x++)
		{
			auto& cell = grid.cells[static_cast<std::size_t>(grid.index(x, y))];
			const bool edge = grid.at(x + 1, y) == Cell::kFree || grid.at(x - 1, y) == Cell::kFree ||
			                  grid.at(x, y + 1) == Cell::kFree || grid.at(x, y - 1) == Cell::kFree;
			if (cell == Cell::kUnknown && edge && random() % 8 != 0) cell = Cell::kOccupied;
			if (cell == Cell::kFree && random() % 300 == 0) cell = Cell::kOccupied;
		}
	return grid;
}

double share_off(
    const Grid& grid, const std::vector<CellIndex>& cells, int directions, const std::vector<std::uint16_t>& swept,
    const RayCaster& caster, double max_range)
{
	std::size_t off = 0;
	for (std::size_t i = 0; i < swept.size(); i++)
	{
		const CellIndex cell = cells[i % cells.size()];
		const double angle = 2 * M_PI * static_cast<double>(i / cells.size()) / directions;
		const double exact = static_cast<double>(caster.cast(grid.center_x(cell), grid.center_y(cell), angle));
		const double range = swept[i] == kNoObstacle ? max_range : swept[i] * grid.cell_size / kRangeUnitsPerCell;
		off += std::abs(range - exact) > grid.cell_size ? 1 : 0;
	}
	return static_cast<double>(off) / static_cast<double>(swept.size());
}

TEST(RangeSweep, IsExactAlongTheAxes)
{
	const Grid grid = make_picture_grid({"#..?.#"}, 0.1);
	const std::vector<std::uint16_t> expected = {56, 40, 8,  kNoObstacle, kNoObstacle, kNoObstacle,
	                                             8,  24, 56, kNoObstacle, kNoObstacle, kNoObstacle};
	EXPECT_EQ(sweep_all(grid, find_free_cells(grid, {}), 4, 5), expected);
}

TEST(RangeSweep, WallsBehindUnknownCellsEndRays)
{
	const Grid grid = make_picture_grid({"#..??#"}, 0.1);
	EXPECT_EQ(sweep_all(grid, find_free_cells(grid, {}), 1, 5), (std::vector<std::uint16_t>{56, 40}));
}

TEST(RangeSweep, NothingLeaksThroughDiagonalWalls)
{
	const Grid grid = make_picture_grid(
	    {"#######",  //
	     "#....#.",  //
	     "#...#..",  //
	     "#..#...",  //
	     "#.#....",  //
	     "##.....",  //
	     "#......"},
	    0.1);
	const std::vector<CellIndex> inside = {grid.index(1, 2), grid.index(1, 5), grid.index(2, 4), grid.index(4, 5)};
	for (const std::uint16_t range : sweep_all(grid, inside, 360, 5)) EXPECT_LT(range, 6 * kRangeUnitsPerCell);
}

TEST(RangeSweep, IsWithinACellOfExactRangesOnAFloor)
{
	const double max_range = 5;
	const Grid grid = make_floor(3);
	const std::vector<CellIndex> cells = find_free_cells(grid, {});
	const std::vector<std::uint16_t> ranges = sweep_all(grid, cells, 72, max_range);
	EXPECT_LT(share_off(grid, cells, 72, ranges, RayCaster(grid, max_range), max_range), 0.01);
}

TEST(RangeSweep, AFewCellsGetWhatTheyGetAmongAll)
{
	const Grid grid = make_floor(5);
	const std::vector<CellIndex> all = find_free_cells(grid, {});
	std::vector<CellIndex> few;
	std::vector<std::uint16_t> expected;
	const std::vector<std::uint16_t> ranges = sweep_all(grid, all, 1, 20);
	for (std::size_t i = 0; i < all.size(); i += 1 + i % 7)
	{
		few.push_back(all[i]);
		expected.push_back(ranges[i]);
	}
	EXPECT_EQ(sweep_all(grid, few, 1, 20), expected);
}

TEST(RangeSweep, IsTheSameWithAndWithoutSimd)
{
	const Grid grid = make_floor(9);
	const std::vector<CellIndex> cells = find_free_cells(grid, {});
	const std::vector<std::uint16_t> with = sweep_all(grid, cells, 90, 6);
	const PortableSimd portable;
	EXPECT_EQ(sweep_all(grid, cells, 90, 6), with);
}

TEST(RangeSweep, ForgetsObstaclesOutOfRangeOnLongMaps)
{
	const int length = 20000;  // [cells], several times what 16 bits of distance span
	Grid grid = make_picture_grid({"#" + std::string(length - 2, '.') + "#"}, 0.05);
	const std::vector<CellIndex> cells = find_free_cells(grid, {});
	const double max_range = 30;
	const std::vector<std::uint16_t> ranges = sweep_all(grid, cells, 2, max_range);
	for (int x = 1; x < length - 1; x++)
	{
		const auto i = static_cast<std::size_t>(x - 1);
		const int ahead = length - 1 - x, behind = x;
		ASSERT_EQ(ranges[i], ahead <= 600 ? ahead * 16 - 8 : kNoObstacle) << x;
		ASSERT_EQ(ranges[cells.size() + i], behind <= 600 ? behind * 16 - 8 : kNoObstacle) << x;
	}
}

TEST(RangeSweep, RefusesRangesThatOverflow)
{
	const Grid grid = make_picture_grid({"..."}, 0.05);
	EXPECT_THROW(sweep_all(grid, {0}, 4, 201), std::invalid_argument);
	EXPECT_NO_THROW(sweep_all(grid, {0}, 4, 199));
}
}  // namespace
}  // namespace d2s1r::test
