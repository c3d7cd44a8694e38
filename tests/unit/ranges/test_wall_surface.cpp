// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "ranges/distance_field.h"
#include "ranges/wall_surface.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
/// Two rooms side by side, 6 m x 8 m each, in cells of 0.1 m. All walls are as thick as `wall` says.
/// \param wall [cells]
Grid two_rooms(int wall)
{
	constexpr int kWidth = 60, kHeight = 80;
	const int width = 2 * kWidth + 3 * wall, height = kHeight + 2 * wall;
	Picture picture;
	for (int row = 0; row < height + 2; row++)
	{
		std::string line;
		for (int column = 0; column < width; column++)
		{
			const bool in_room = row > wall && row <= wall + kHeight && column >= wall && column < width - wall &&
			                     (column < wall + kWidth || column >= 2 * wall + kWidth);
			line += in_room || row == 0 || row == height + 1 ? '.' : '#';
		}
		picture.push_back(line);
	}
	return make_picture_grid(picture, 0.1);
}
}  // namespace

TEST(WallSurface, ThinWallsAreSharp)
{
	const WallMeasure walls = measure_walls(two_rooms(1));
	EXPECT_DOUBLE_EQ(walls.thickness, 0.1);
	EXPECT_EQ(walls.surface_depth, 0);
	EXPECT_EQ(walls.surface_tolerance(), 0);
}

TEST(WallSurface, TheThickerTheWallsTheDeeperTheirSurfaces)
{
	double last = 0;
	for (const int wall : {2, 3, 5})
	{
		const WallMeasure walls = measure_walls(two_rooms(wall));
		EXPECT_NEAR(walls.thickness, 0.1 * wall, 1e-9);
		EXPECT_GT(walls.surface_depth, last);
		EXPECT_LT(walls.surface_depth, walls.thickness) << "it is inside the wall";
		last = walls.surface_depth;
	}
}

TEST(WallSurface, AMapWithThinWallsIsSharpThoughItHasThickOnes)
{
	Grid grid = two_rooms(5);
	for (int column = 10; column < 50; column++)
		for (int row = 10; row < 80; row += 8)
			grid.cells[static_cast<std::size_t>(grid.index(column, row))] = Cell::kOccupied;
	EXPECT_EQ(measure_walls(grid).surface_depth, 0);
}

TEST(WallSurface, AMapWithoutWallsBetweenFreeCellsTellsNothing)
{
	EXPECT_EQ(measure_walls(make_picture_grid({"###", "#.#", "###"}, 0.1)).thickness, 0);
}

TEST(WallSurface, MeasureOfAMapTellsHowMuchOfItsFreeSpaceWallsBound)
{
	const MapMeasure closed = measure_map(make_picture_grid({"####", "#..#", "####"}, 0.5));
	EXPECT_DOUBLE_EQ(closed.free_area, 0.5);
	EXPECT_DOUBLE_EQ(closed.wall_area, 2.5);
	EXPECT_EQ(closed.open_border, 0);
	EXPECT_EQ(closed.wall_thickness, 0) << "there are too few walls to tell";
	EXPECT_DOUBLE_EQ(measure_map(make_picture_grid({"##?", "#..", "###"}, 0.5)).open_border, 2.0 / 6);
	EXPECT_EQ(measure_map(make_picture_grid({"...", "..."}, 0.5)).open_border, 1);
	EXPECT_DOUBLE_EQ(measure_map(two_rooms(3)).wall_thickness, 0.1 * 3);
}

TEST(WallSurface, MovesTheSurfacesAndKeepsTheMiddleLine)
{
	const Picture before = {"..........", "..#####...", "..#####...", "..#####...",
	                        "..#####...", "..#####...", ".........."};
	const Picture after = {"..........", "..........", "...###....", "...###....",
	                       "...###....", "..........", ".........."};
	const Picture line = {"..........", "..........", "..........", "....#.....",
	                      "..........", "..........", ".........."};
	EXPECT_EQ(with_surfaces_deeper(make_picture_grid(before, 0.1), 0.06).cells, make_picture_grid(after, 0.1).cells);
	EXPECT_EQ(with_surfaces_deeper(make_picture_grid(before, 0.1), 0.5).cells, make_picture_grid(line, 0.1).cells);
}

TEST(WallSurface, UnknownSpaceBehindAWallDoesNotMoveIt)
{
	const Picture before = {".....", "#####", "#####", "#####", "?????"};
	const Picture after = {".....", ".....", "#####", "#####", "?????"};
	EXPECT_EQ(with_surfaces_deeper(make_picture_grid(before, 0.1), 0.06).cells, make_picture_grid(after, 0.1).cells);
}

TEST(WallSurface, FurnitureIsWhatIsSmallAndStandsApart)
{
	//                                         1.2 m long        0.4 m     0.1 m from it   0.2 m from both
	const Grid grid = make_picture_grid(
	    {"..................", ".############.....", "..................", "..................", ".####.#...#.......",
	     "..................", ".........?#.......", ".................."},
	    0.1);
	std::vector<std::pair<int, int>> found;
	for (const CellIndex cell : find_furniture(grid)) found.emplace_back(cell % grid.width, cell / grid.width);
	std::sort(found.begin(), found.end());
	const std::vector<std::pair<int, int>> expected{{1, 3}, {2, 3}, {3, 3}, {4, 3}, {6, 3}, {10, 3}};
	EXPECT_EQ(found, expected) << "rows count from below; {10, 1} is beside an unknown cell";
}

TEST(WallSurface, PiecesThatAreNearAreOnePiece)
{
	const auto count = [](const std::string& row, double cell)
	{
		const std::string free(row.size() + 2, '.');
		return find_furniture(make_picture_grid({free, "." + row + ".", free}, cell)).size();
	};
	EXPECT_EQ(count("#.#.#.#.#.#.#.#.#.#.#.", 0.05), 0U) << "a wall that is dotted because it is far away";
	EXPECT_EQ(count("#...#...#...#...#...#.", 0.05), 6U) << "posts";
	EXPECT_EQ(count("###################..", 0.05), 19U);
	EXPECT_EQ(count("####################.", 0.05), 0U) << "one metre long";
	EXPECT_EQ(count("##..", 0.5), 0U);
}

TEST(DistanceField, IsZeroWithinTheTolerance)
{
	const Grid grid = make_picture_grid({"......", "..#...", "......", "......", "......"}, 0.1);
	const DistanceField sharp(grid), tolerant(grid, 0.08);
	for (const double y : {0.05, 0.15, 0.25, 0.35})
		EXPECT_NEAR(tolerant.at(0.25, y).value, std::max(0.0F, sharp.at(0.25, y).value - 0.08F), 1e-3F) << y;
	EXPECT_EQ(tolerant.tolerance(), 0.08);
}
}  // namespace d2s1r::test
