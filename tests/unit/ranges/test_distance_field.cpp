// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ranges/distance_field.h"
#include "ranges/wall_surface.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
constexpr double kStep = 1e-3;  //!< [cells] rounding

/// [cells] How far off a distance may be: beyond the exact ones by half of what is between two codes.
double step_at(double cells)
{
	const bool is_exact = cells <= static_cast<double>(DistanceField::kExactCells);
	return is_exact ? kStep : kStep + 0.5 * static_cast<double>(DistanceField::kCellsPerCode);
}

Grid random_grid(std::mt19937& random, int width, int height, int walls)
{
	Grid grid = make_picture_grid(
	    Picture(static_cast<std::size_t>(height), std::string(static_cast<std::size_t>(width), '.')), 0.05, -2, 3);
	for (int i = 0; i < walls; i++) grid.cells[random() % grid.cells.size()] = Cell::kOccupied;
	for (int i = 0; i < 20; i++)
		if (auto& cell = grid.cells[random() % grid.cells.size()]; cell == Cell::kFree) cell = Cell::kUnknown;
	return grid;
}

/// [m] from a cell's centre to the nearest occupied cell's, by looking at all.
double brute_force(const Grid& grid, int column, int row)
{
	double nearest = static_cast<double>(DistanceField::kReachCells);
	for (int y = 0; y < grid.height; y++)
		for (int x = 0; x < grid.width; x++)
			if (grid.at(x, y) == Cell::kOccupied) nearest = std::min(nearest, std::hypot(x - column, y - row));
	return nearest * grid.cell_size;
}

Distance at_center(const DistanceField& field, const Grid& grid, int column, int row)
{
	const CellIndex cell = grid.index(column, row);
	return field.at(grid.center_x(cell) + 1e-6, grid.center_y(cell) + 1e-6);
}
}  // namespace

TEST(DistanceField, IsTheDistanceToTheNearestWallOnRandomGrids)
{
	std::mt19937 random(5);
	for (const int walls : {1, 5, 60, 900})
	{
		const Grid grid = random_grid(random, 90, 70, walls);
		const DistanceField field(grid);
		EXPECT_EQ(field.cell_size(), grid.cell_size);
		for (int y = 0; y < grid.height; y++)
			for (int x = 0; x < grid.width; x++)
			{
				const double expected = brute_force(grid, x, y);
				ASSERT_NEAR(
				    static_cast<double>(at_center(field, grid, x, y).value), expected,
				    step_at(expected / grid.cell_size) * grid.cell_size)
				    << walls << " walls, cell " << x << " " << y;
			}
	}
}

TEST(DistanceField, IsCutOffAndFlatFarFromWalls)
{
	std::mt19937 random(5);
	Grid grid = random_grid(random, 90, 40, 0);
	const double reach = static_cast<double>(DistanceField::kReachCells) * grid.cell_size;
	for (const int wall : {-1, 0})
	{
		if (wall >= 0) grid.cells[static_cast<std::size_t>(grid.index(wall, 20))] = Cell::kOccupied;
		const Distance far = at_center(DistanceField(grid), grid, 60, 20);
		EXPECT_NEAR(static_cast<double>(far.value), reach, kStep * grid.cell_size);
		EXPECT_EQ(far.gradient_x, 0);
		EXPECT_EQ(far.gradient_y, 0);
	}
}

TEST(DistanceField, IsRightFarOutInAWideMap)
{
	constexpr int kWidth = 60000;
	Grid grid{kWidth, 1, 1, 0, 0, std::vector<Cell>(kWidth, Cell::kFree)};
	for (int x = 0; x < kWidth; x += 5) grid.cells[static_cast<std::size_t>(x)] = Cell::kOccupied;
	const DistanceField field(grid);
	for (int x = 0; x < kWidth - 5; x++)
		ASSERT_NEAR(static_cast<double>(field.at(x + 0.5, 0.5).value), std::min(x % 5, 5 - x % 5), kStep) << x;
}

TEST(DistanceField, WallsAtTheEdgeOfTheGridActOutwards)
{
	const DistanceField field(make_picture_grid({"###", "#.#", "###"}, 0.5, 10, -4));
	const Distance behind = field.at(9.45, -3.25);  // the centres of the left column lie at x = 10.25
	EXPECT_NEAR(static_cast<double>(behind.value), 0.8, 1e-3);
	EXPECT_NEAR(static_cast<double>(behind.gradient_x), -1, 1e-3);
	EXPECT_NEAR(static_cast<double>(behind.gradient_y), 0, 1e-3);
	for (const auto& [x, y] : {std::pair{10.2, -3.25}, {11.3, -3.25}, {10.75, -3.8}, {10.75, -2.7}})
		EXPECT_NEAR(static_cast<double>(field.at(x, y).value), 0.05, 1e-3) << x << " " << y;
}

TEST(DistanceField, FarOutsideIsTheGreatestDistanceWithoutGradient)
{
	const DistanceField field(make_picture_grid({"###", "###", "###"}, 0.5));
	const auto reach = DistanceField::kReachCells * 0.5F;
	for (const auto& [x, y] : {std::pair{-17.0, 0.7}, {0.7, -17.0}, {18.6, 0.7}, {0.7, 18.6}, {-1e6, 1e6}, {NAN, 0.7}})
	{
		const Distance distance = field.at(x, y);
		EXPECT_NEAR(static_cast<double>(distance.value), static_cast<double>(reach), 1e-3) << x << " " << y;
		EXPECT_EQ(distance.gradient_x, 0);
		EXPECT_EQ(distance.gradient_y, 0);
	}
	EXPECT_EQ(field.at(0.75, 0.75).value, 0);
}

TEST(DistanceField, IsBilinearBetweenCentres)
{
	std::mt19937 random(8);
	const Grid grid = random_grid(random, 40, 30, 30);
	const DistanceField field(grid);
	for (int i = 0; i < 500; i++)
	{
		const int x = static_cast<int>(random() % 38U), y = static_cast<int>(random() % 28U);
		const double u = static_cast<double>(random() % 97) / 97, v = static_cast<double>(random() % 97) / 97;
		const double expected = (1 - v) * ((1 - u) * brute_force(grid, x, y) + u * brute_force(grid, x + 1, y)) +
		                        v * ((1 - u) * brute_force(grid, x, y + 1) + u * brute_force(grid, x + 1, y + 1));
		const CellIndex cell = grid.index(x, y);
		const Distance distance =
		    field.at(grid.center_x(cell) + u * grid.cell_size + 1e-7, grid.center_y(cell) + v * grid.cell_size + 1e-7);
		ASSERT_NEAR(
		    static_cast<double>(distance.value), expected,
		    step_at(expected / grid.cell_size + M_SQRT1_2) * grid.cell_size);
	}
}

TEST(DistanceField, GradientIsTheSlope)
{
	std::mt19937 random(9);
	const Grid grid = random_grid(random, 60, 60, 60);
	const DistanceField field(grid);
	const double h = 0.1 * grid.cell_size;
	for (int i = 0; i < 2000; i++)
	{
		// the slope jumps at centres: both ends of the difference lie between the same ones
		const CellIndex cell = grid.index(static_cast<int>(random() % 58U), static_cast<int>(random() % 58U));
		const double x = grid.center_x(cell) + (0.15 + 0.007 * static_cast<double>(random() % 100)) * grid.cell_size;
		const double y = grid.center_y(cell) + (0.15 + 0.007 * static_cast<double>(random() % 100)) * grid.cell_size;
		const Distance distance = field.at(x, y);
		const auto slope = [h](const Distance& after, const Distance& before)
		{ return static_cast<double>(after.value - before.value) / (2 * h); };
		ASSERT_NEAR(static_cast<double>(distance.gradient_x), slope(field.at(x + h, y), field.at(x - h, y)), 2e-3);
		ASSERT_NEAR(static_cast<double>(distance.gradient_y), slope(field.at(x, y + h), field.at(x, y - h)), 2e-3);
	}
}

TEST(DistanceField, OfAReadingOfAMapIsThatOfItsGrid)
{
	Picture picture(30, std::string(50, '.'));
	for (std::string& row : picture) row.replace(20, 4, "####").replace(35, 10, "##########");
	const Grid drawn = make_picture_grid(picture, 0.05, -2, 3);
	const Grid walls = with_wall_surfaces_only(drawn),
	           deeper = with_wall_surfaces_only(with_surfaces_deeper(drawn, 0.12));
	const SkipMap map = make_skip_map(walls, deeper, {});
	for (const int reading : {0, 1})
	{
		const DistanceField expected(reading == 0 ? walls : deeper, 0.03), field(map, reading, 0.03);
		ASSERT_EQ(field.width(), expected.width());
		ASSERT_EQ(field.height(), expected.height());
		EXPECT_NEAR(field.origin_x(), expected.origin_x(), 1e-12);
		EXPECT_NEAR(field.origin_y(), expected.origin_y(), 1e-12);
		EXPECT_EQ(field.tolerance(), expected.tolerance());
		const auto count = static_cast<std::ptrdiff_t>(field.width()) * field.height();
		EXPECT_TRUE(std::equal(field.cells(), field.cells() + count, expected.cells())) << reading;
	}
}
}  // namespace d2s1r::test
