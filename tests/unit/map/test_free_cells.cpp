// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "map/free_cells.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
/// The picture with '.' left only where a sensor can stand, '-' where it cannot though the cell is free.
Picture mark(const Picture& picture, const FreeCellParameters& parameters, double cell_size = 1.0)
{
	Picture marked = picture;
	for (auto& line : marked) std::replace(line.begin(), line.end(), '.', '-');
	const Grid grid = make_picture_grid(picture, cell_size);
	for (const CellIndex cell : find_free_cells(grid, parameters))
		marked[picture.size() - 1 - static_cast<std::size_t>(cell / grid.width)]
		      [static_cast<std::size_t>(cell % grid.width)] = '.';
	return marked;
}

FreeCellParameters with_clearance(double clearance)
{
	FreeCellParameters parameters;
	parameters.clearance = clearance;
	return parameters;
}
}  // namespace

TEST(FreeCells, AreTheFreeOnesInOrder)
{
	const Grid grid = make_picture_grid({"#.?", "..#"}, 1.0);
	EXPECT_EQ(find_free_cells(grid, {}), (std::vector<CellIndex>{0, 1, 4}));
	EXPECT_TRUE(find_free_cells(make_picture_grid({"##"}, 1.0), {}).empty());
}

TEST(FreeCells, LargestRegionIsConnectedByTheSidesOfCells)
{
	FreeCellParameters parameters;
	parameters.largest_region_only = true;
	const Picture picture{
	    "..#.#",  //
	    ".##..",  //
	    "#.?..",  //
	    "..##."};
	const Picture expected{
	    "--#.#",  //
	    "-##..",  //
	    "#-?..",  //
	    "--##."};
	EXPECT_EQ(mark(picture, parameters), expected);
	EXPECT_EQ(mark({".#."}, parameters), (Picture{".#-"}));  // of equal ones the first
	EXPECT_TRUE(find_free_cells(make_picture_grid({"##"}, 1.0), parameters).empty());
}

TEST(FreeCells, ClearanceIsADiscAroundOccupiedCells)
{
	const Picture picture{
	    ".......",  //
	    ".......",  //
	    ".......",  //
	    "...#...",  //
	    ".......",  //
	    ".......",  //
	    "......."};
	const Picture beyond_the_diagonal{
	    ".......",  //
	    ".......",  //
	    "..---..",  //
	    "..-#-..",  //
	    "..---..",  //
	    ".......",  //
	    "......."};
	EXPECT_EQ(mark(picture, with_clearance(1.5)), beyond_the_diagonal);
	const Picture beyond_two_and_one{
	    ".......",  //
	    "..---..",  //
	    ".-----.",  //
	    ".--#--.",  //
	    ".-----.",  //
	    "..---..",  //
	    "......."};
	EXPECT_EQ(mark(picture, with_clearance(2.5)), beyond_two_and_one);
	// A cell of exactly the clearance away is clear.
	EXPECT_EQ(mark(picture, with_clearance(1.0)), picture);
}

TEST(FreeCells, UnknownCellsNeedNoClearance)
{
	EXPECT_EQ(mark({"?.?"}, with_clearance(3)), (Picture{"?.?"}));
}

TEST(FreeCells, ClearanceAgreesWithMeasuringEveryPair)
{
	std::mt19937 generator(7);
	Picture picture(23, std::string(31, '.'));
	for (int i = 0; i < 25; i++) picture[generator() % 23][generator() % 31] = '#';
	const Grid grid = make_picture_grid(picture, 0.1);
	for (const double clearance : {0.05, 0.15, 0.31, 0.45, 0.9})
	{
		std::vector<CellIndex> expected;
		for (CellIndex cell = 0; cell < grid.width * grid.height; cell++)
		{
			bool clear = grid.cells[static_cast<std::size_t>(cell)] == Cell::kFree;
			for (CellIndex other = 0; other < grid.width * grid.height; other++)
				if (grid.cells[static_cast<std::size_t>(other)] == Cell::kOccupied)
					clear = clear && std::hypot(
					                     grid.center_x(cell) - grid.center_x(other),
					                     grid.center_y(cell) - grid.center_y(other)) >= clearance;
			if (clear) expected.push_back(cell);
		}
		EXPECT_EQ(find_free_cells(grid, with_clearance(clearance)), expected) << clearance;
	}
}

TEST(FreeCells, RegionIsTakenBeforeTheClearance)
{
	FreeCellParameters parameters = with_clearance(1.5);
	parameters.largest_region_only = true;
	const Picture picture{
	    "#########.",  //
	    "#.......#.",  //
	    "#.......#.",  //
	    "#.......#.",  //
	    "#########."};
	const Picture expected{
	    "#########-",  //
	    "#-------#-",  //
	    "#-.....-#-",  //
	    "#-------#-",  //
	    "#########-"};
	EXPECT_EQ(mark(picture, parameters), expected);
}
}  // namespace d2s1r::test
