// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "portable_simd.h"
#include "ranges/ray_caster.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
const Picture kRoom = {
    "#########",  //
    "#.......#",  //
    "#.......?",  //
    "#.......#",  //
    "#########"};

TEST(RayCaster, MeasuresToTheNearSideOfWalls)
{
	const Grid grid = make_picture_grid(kRoom, 0.5, 10, -3);
	const RayCaster caster(grid, 30);
	const double x = grid.center_x(grid.index(3, 1)), y = grid.center_y(grid.index(3, 1));
	EXPECT_FLOAT_EQ(caster.cast(x, y, 0), 4.5F * 0.5F);
	EXPECT_FLOAT_EQ(caster.cast(x, y, M_PI), 2.5F * 0.5F);
	EXPECT_FLOAT_EQ(caster.cast(x, y, M_PI / 2), 2.5F * 0.5F);
	EXPECT_FLOAT_EQ(caster.cast(x, y, -M_PI / 2), 0.5F * 0.5F);
	EXPECT_FLOAT_EQ(caster.cast(x + 0.2, y, 0), 4.5F * 0.5F - 0.2F);
}

TEST(RayCaster, UnknownCellsAndTheOutsideEndNoRay)
{
	const Grid grid = make_picture_grid(kRoom, 0.5);
	const double x = grid.center_x(grid.index(4, 2)), y = grid.center_y(grid.index(4, 2));
	EXPECT_FLOAT_EQ(RayCaster(grid, 30).cast(x, y, 0), 30);
	const Grid open = make_picture_grid({"...."}, 1);
	EXPECT_FLOAT_EQ(RayCaster(open, 30).cast(0.5, 0.5, 0), 30);
}

TEST(RayCaster, IsZeroInsideObstaclesAndMaxRangeBeyond)
{
	const Grid grid = make_picture_grid(kRoom, 0.5);
	EXPECT_EQ(RayCaster(grid, 30).cast(0.2, 0.2, 1), 0);
	EXPECT_EQ(RayCaster(grid, 1).cast(0.75, 0.75, 0), 1);
}

TEST(RayCaster, SeesAcrossHallsOfManyCells)
{
	Grid grid = make_picture_grid(enlarge({"....."}, 600), 0.05);
	for (int y = 0; y < grid.height; y++)
		for (const int x : {0, grid.width - 1})
			grid.cells[static_cast<std::size_t>(grid.index(x, y))] = Cell::kOccupied;
	const RayCaster caster(grid, 200);
	const double y = 255.5 * 0.05;  // clearances of cells end at 255
	for (const double angle : {0.0, M_PI}) EXPECT_NEAR(caster.cast(75, y, angle), 74.95, 1e-3) << angle;
}

TEST(RayCaster, RaysFromOutsideEnterTheGrid)
{
	const Grid grid = make_picture_grid({"..#"}, 1);
	const RayCaster caster(grid, 30);
	EXPECT_FLOAT_EQ(caster.cast(-4, 0.5, 0), 6);
	EXPECT_FLOAT_EQ(caster.cast(-4, 0.5, M_PI), 30);
	EXPECT_FLOAT_EQ(caster.cast(-4, 1.5, 0), 30);
}

TEST(RayCaster, DoesNotLeakThroughCornersOfDiagonalWalls)
{
	const Grid grid = make_picture_grid(
	    {".....#",  //
	     "....#.",  //
	     "...#..",  //
	     "..#...",  //
	     ".#....",  //
	     "#....."},
	    1);
	const RayCaster caster(grid, 30);
	for (int i = 0; i < 4; i++) EXPECT_LT(caster.cast(i + 1.5, i + 0.5, 3 * M_PI / 4), 1.5) << i;
}

TEST(RayCaster, AgreesWithCellByCellTraversalOnRandomMaps)
{
	std::mt19937 random(7);
	for (int map = 0; map < 10; map++)
	{
		Grid grid = make_picture_grid(enlarge(Picture(6, std::string(9, '.')), 10), 0.05, -1, 2);
		for (int i = 0; i < 60; i++) grid.cells[random() % grid.cells.size()] = Cell::kOccupied;
		const RayCaster caster(grid, 3);
		std::uniform_real_distribution<double> unit(0, 1);
		for (int i = 0; i < 500; i++)
		{
			const double x = grid.origin_x + unit(random) * grid.width * grid.cell_size;
			const double y = grid.origin_y + unit(random) * grid.height * grid.cell_size;
			const double angle = 2 * M_PI * unit(random);
			ASSERT_NEAR(caster.cast(x, y, angle), cast_exactly(grid, x, y, angle, 3), 1e-5)
			    << x << " " << y << " " << angle;
		}
	}
}

/// Free space with single obstacle cells.
Grid make_field(std::mt19937& random)
{
	Grid grid = make_picture_grid(enlarge(Picture(12, std::string(17, '.')), 10), 0.05, -1, 2);
	for (int i = 0; i < 150; i++) grid.cells[random() % grid.cells.size()] = Cell::kOccupied;
	for (int i = 0; i < 50; i++) grid.cells[random() % grid.cells.size()] = Cell::kUnknown;
	return grid;
}

TEST(RayCaster, ScansCounterClockwiseFromX)
{
	const Grid grid = make_picture_grid(kRoom, 0.5);
	const RayCaster caster(grid, 30);
	const std::vector<float> ranges = caster.scan(1.26, 0.77, 8);
	ASSERT_EQ(ranges.size(), 8U);
	for (int i = 0; i < 8; i++)
		EXPECT_NEAR(ranges[static_cast<std::size_t>(i)], caster.cast(1.26, 0.77, i * M_PI / 4), 1e-5) << i;
}

TEST(RayCaster, ScansAreWhatSingleRaysAre)
{
	std::mt19937 random(8);
	std::uniform_real_distribution<double> unit(-0.05, 1.05);
	const Grid grid = make_field(random);
	const RayCaster caster(grid, 4);
	int different = 0;
	for (int scan = 0; scan < 100; scan++)
	{
		const double x = grid.origin_x + unit(random) * grid.width * grid.cell_size;
		const double y = grid.origin_y + unit(random) * grid.height * grid.cell_size;
		const std::vector<float> ranges = caster.scan(x, y, 181);
		for (int i = 0; i < 181; i++)
		{
			const float single = caster.cast(x, y, 2 * M_PI * i / 181);
			different += std::abs(ranges[static_cast<std::size_t>(i)] - single) > 1e-4F ? 1 : 0;
		}
	}
	EXPECT_LE(different, 10) << "of 18100 rays, those that graze a corner";
}

TEST(RayCaster, SeesNothingFromWhereNobodyCanBe)
{
	const Grid grid = make_picture_grid({"###", "#.#", "###"}, 1.0);
	const RayCaster through(grid, 4);
	for (const double far : {std::nan(""), HUGE_VAL, -1e300, 1e12})
	{
		EXPECT_EQ(through.scan(far, 1.5, 12), std::vector<float>(12, 4)) << far;
		EXPECT_EQ(through.scan(1.5, far, 12), std::vector<float>(12, 4)) << far;
		EXPECT_EQ(through.scan(far, far, 12), std::vector<float>(12, 4)) << far;
		EXPECT_EQ(through.cast(far, 1.5, 0), 4) << far;
	}
	EXPECT_EQ(through.cast(1.5, 1.5, std::nan("")), 4);
}

TEST(RayCaster, ScansAreTheSameWithAndWithoutSimd)
{
	std::mt19937 random(9);
	const Grid grid = make_field(random);
	const RayCaster caster(grid, 4);
	const std::vector<float> with = caster.scan(3.013, 4.041, 720);
	const PortableSimd portable;
	EXPECT_EQ(caster.scan(3.013, 4.041, 720), with);
}
}  // namespace
}  // namespace d2s1r::test
