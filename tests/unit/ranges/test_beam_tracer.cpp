// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "portable_simd.h"
#include "ranges/beam_tracer.h"
#include "ranges/wall_surface.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
constexpr double kCell = 0.05;  // [m]

/// Free space with walls, rooms of unknown space and single cells.
Grid random_room(unsigned seed)
{
	std::mt19937 random(seed);
	Picture picture(90, std::string(130, '.'));
	for (int i = 0; i < 40; i++)
	{
		const std::size_t x = random() % 110, y = random() % 80, width = 1 + random() % 20, height = 1 + random() % 10;
		for (std::size_t v = y; v < std::min(y + height, picture.size()); v++)
			for (std::size_t u = x; u < std::min(x + width, picture[v].size()); u++)
				picture[v][u] = i % 3 == 0 ? '?' : (i % 3 == 1 ? '#' : '.');
	}
	return make_picture_grid(picture, kCell, -2, 1);
}

BeamArrays random_returns(std::mt19937& random, std::size_t count)
{
	std::uniform_real_distribution<float> turn(0, 6.28F), range(0.1F, 8);
	BeamArrays returns;
	for (std::size_t i = 0; i < count; i++)
	{
		const float angle = turn(random);
		returns.unit_x.push_back(std::cos(angle));
		returns.unit_y.push_back(std::sin(angle));
		returns.range.push_back(range(random));
	}
	return returns;
}

Grid without_furniture(Grid grid)
{
	for (const CellIndex cell : find_furniture(grid)) grid.cells[static_cast<std::size_t>(cell)] = Cell::kFree;
	return grid;
}

struct Walk
{
	double walls = 0;
	double unknown = 0;  // [m]
};

/// What lies along a beam, by steps of a fiftieth of a cell.
Walk walk_along(const Grid& grid, double x, double y, double angle, double range)
{
	constexpr double kStep = kCell / 50;
	Walk walk;
	double in_wall = 0;  // [cells]
	const int steps = static_cast<int>(std::ceil(range / kStep - 0.5));
	for (int i = 0; i < steps; i++)
	{
		const double t = (i + 0.5) * kStep;
		const int u = static_cast<int>(std::floor((x + std::cos(angle) * t - grid.origin_x) / kCell));
		const int v = static_cast<int>(std::floor((y + std::sin(angle) * t - grid.origin_y) / kCell));
		const Cell cell = grid.contains(u, v) ? grid.at(u, v) : Cell::kUnknown;
		if (cell == Cell::kUnknown) walk.unknown += kStep;
		if (cell != Cell::kOccupied && t < range - 0.15) walk.walls += std::min(in_wall, 1.0);
		in_wall = cell == Cell::kOccupied ? in_wall + kStep / kCell : 0;
	}
	return walk;
}

class BeamTracing : public testing::TestWithParam<std::int64_t>
{
   protected:
	const ChosenSimd chosen_{GetParam()};
};
}  // namespace

TEST_P(BeamTracing, SeesWhatLiesAlongTheBeams)
{
	int beams = 0, same = 0;
	for (const unsigned seed : {1U, 2U, 3U})
	{
		const Grid grid = random_room(seed), walls = without_furniture(grid);
		const BeamTracer tracer(grid, find_furniture(grid));
		std::mt19937 random(seed);
		for (int k = 0; k < 20; k++)
		{
			const auto uniform = [&](double least, double greatest)
			{ return std::uniform_real_distribution<double>(least, greatest)(random); };
			const mrpt::math::TPose2D sensor{uniform(-2, 4.4), uniform(1, 5.4), uniform(-3, 3)};
			const BeamArrays returns = random_returns(random, 40);
			TracedBeams traced;
			tracer.trace(returns, sensor, traced);
			for (std::size_t i = 0; i < returns.range.size(); i++, beams++)
			{
				const double angle = sensor.phi + std::atan2(returns.unit_y[i], returns.unit_x[i]);
				const Walk walk = walk_along(walls, sensor.x, sensor.y, angle, static_cast<double>(returns.range[i]));
				EXPECT_NEAR(static_cast<double>(traced.unknown[i]), walk.unknown, 0.06) << sensor << " " << angle;
				same += std::abs(static_cast<double>(traced.walls[i]) - walk.walls) < 0.05 ? 1 : 0;
			}
		}
	}
	EXPECT_GT(same, 0.985 * beams);  // steps jump over corners of cells
}

TEST_P(BeamTracing, TwoReadingsOfAMapAreFollowedAsEachAlone)
{
	Picture picture(40, std::string(70, '.'));
	for (std::string& row : picture) row.replace(30, 3, "###").replace(50, 12, "############");
	for (std::size_t row = 10; row < 20; row++) picture[row].replace(5, 9, "#########");
	picture[30].replace(0, 30, std::string(30, '?'));
	const Grid drawn = make_picture_grid(picture, kCell);
	const Grid deeper = with_wall_surfaces_only(with_surfaces_deeper(drawn, 0.12)),
	           walls = with_wall_surfaces_only(drawn);
	const std::vector<CellIndex> furniture = find_furniture(drawn);
	ASSERT_FALSE(furniture.empty());
	const SkipMap map = make_skip_map(walls, deeper, furniture);
	std::mt19937 random(4);
	int differ = 0;
	for (int k = 0; k < 50; k++)
	{
		const auto uniform = [&](double most) { return std::uniform_real_distribution<double>(0.01, most)(random); };
		const mrpt::math::TPose2D sensor{
		    drawn.origin_x + uniform(70 * kCell), drawn.origin_y + uniform(40 * kCell), uniform(6)};
		const BeamArrays returns = random_returns(random, 40);
		TracedBeams of_both[2];
		for (const int reading : {0, 1})
		{
			TracedBeams &both = of_both[reading], alone;
			BeamTracer(map, reading).trace(returns, sensor, both);
			BeamTracer(reading == 0 ? walls : deeper, furniture).trace(returns, sensor, alone);
			EXPECT_EQ(both.end, alone.end) << sensor;
			for (std::size_t i = 0; i < returns.range.size(); i++)
			{
				EXPECT_NEAR(both.walls[i], alone.walls[i], 1e-3) << sensor << " " << i;
				EXPECT_NEAR(both.unknown[i], alone.unknown[i], 1e-3) << sensor << " " << i;
			}
		}
		differ += of_both[0].end != of_both[1].end ? 1 : 0;
	}
	EXPECT_GT(differ, 0);
}

TEST_P(BeamTracing, FurnitureIsPassedButIsNoWall)
{
	Picture picture(30, std::string(60, '.'));
	for (std::string& row : picture) row[40] = '#';
	picture[15][20] = '#';
	const Grid grid = make_picture_grid(picture, kCell);
	const BeamTracer tracer(grid, find_furniture(grid));
	const double y = (30 - 15 - 0.5) * kCell;
	BeamArrays returns;
	returns.unit_x.assign(8, 1), returns.unit_y.assign(8, 0);
	returns.range = {0.4F, 1.02F, 1.3F, 1.5F, 2.02F, 2.6F, 0.1F, 0.1F};
	TracedBeams traced;
	tracer.trace(returns, {0.01, y, 0}, traced);
	EXPECT_EQ(traced.walls, (std::vector<float>{0, 0, 0, 0, 0, 1, 0, 0}));
	TracedBeams as_walls;
	BeamTracer(grid).trace(returns, {0.01, y, 0}, as_walls);
	EXPECT_EQ(as_walls.walls, (std::vector<float>{0, 0, 1, 1, 1, 2, 0, 0}));
	EXPECT_EQ(static_cast<Cell>(traced.end[1]), Cell::kOccupied) << "it is occupied all the same";
	EXPECT_EQ(static_cast<Cell>(traced.end[2]), Cell::kFree);
	EXPECT_EQ(static_cast<Cell>(traced.end[4]), Cell::kOccupied);
}

TEST_P(BeamTracing, ACornerCountsByTheWayThroughIt)
{
	const BeamTracer tracer(make_picture_grid({"....", "..#.", "....", "...."}, 1));
	BeamArrays returns;
	returns.unit_x.assign(8, std::sqrt(0.5F)), returns.unit_y.assign(8, -std::sqrt(0.5F)),
	    returns.range.assign(8, 3.6F);
	TracedBeams traced;
	for (const double inside : {-0.1, 0.1, 0.3, 0.6, 0.9})  // [cells] from the cell's corner, along its sides
	{
		tracer.trace(returns, {0.5 + inside, 3.5, 0}, traced);
		EXPECT_NEAR(traced.walls[0], std::clamp(inside * M_SQRT2, 0.0, 1.0), 1e-5) << inside;
	}
}

TEST_P(BeamTracing, KnowsTheCellsAtTheEnds)
{
	const Grid grid = make_picture_grid({"..#", ".??", "..."}, 1);
	const BeamTracer tracer(grid);
	BeamArrays returns;
	returns.unit_x = {1, 1, 0, 0.7071068F, -1, 1, 1, 1};
	returns.unit_y = {0, 0, 1, 0.7071068F, 0, 0, 0, 0};
	returns.range = {0.2F, 2, 2, 2.828427F, 3, 50, -1e6F, -1e6F};
	TracedBeams traced;
	tracer.trace(returns, {0.5, 0.5, 0}, traced);
	const std::vector<Cell> expected = {Cell::kFree,     Cell::kFree,    Cell::kFree,
	                                    Cell::kOccupied, Cell::kUnknown, Cell::kUnknown};
	for (std::size_t i = 0; i < expected.size(); i++) EXPECT_EQ(static_cast<Cell>(traced.end[i]), expected[i]) << i;
	EXPECT_FLOAT_EQ(traced.unknown[4], 2.5);
	EXPECT_FLOAT_EQ(traced.unknown[5], 47.5);
	TracedBeams ends;
	tracer.locate_ends(returns, {0.5, 0.5, 0}, ends);
	EXPECT_EQ(ends.end, traced.end);
	EXPECT_EQ(ends.unknown, std::vector<float>(returns.range.size(), 0));
	EXPECT_EQ(ends.walls, ends.unknown);
}

TEST_P(BeamTracing, FromOutsideAllIsUnknown)
{
	const BeamTracer tracer(make_picture_grid({"...", "..."}, 1));
	BeamArrays returns;
	returns.unit_x.assign(8, 1);
	returns.unit_y.assign(8, 0);
	returns.range.assign(8, 4);
	TracedBeams traced;
	for (const auto& sensor : {mrpt::math::TPose2D{-1, 1, 0}, {3.5, 1, 0}, {1, -0.01, 0}, {1, 1e9, 0}})
	{
		tracer.trace(returns, sensor, traced);
		EXPECT_EQ(traced.walls[0], 0);
		EXPECT_EQ(traced.unknown[0], 4);
		EXPECT_EQ(static_cast<Cell>(traced.end[0]), Cell::kUnknown);
	}
}

TEST_P(BeamTracing, IsBitForBitTheSameAsPortableLoops)
{
	const BeamTracer tracer(random_room(5));
	std::mt19937 random(5);
	const BeamArrays returns = random_returns(random, 400);
	TracedBeams chosen, portable;
	tracer.trace(returns, {1.234, 3.21, 0.77}, chosen);
	{
		const PortableSimd plain;
		tracer.trace(returns, {1.234, 3.21, 0.77}, portable);
	}
	EXPECT_EQ(chosen.walls, portable.walls);
	EXPECT_EQ(chosen.unknown, portable.unknown);
	EXPECT_EQ(chosen.end, portable.end);
}

INSTANTIATE_TEST_SUITE_P(OnThisMachine, BeamTracing, testing::ValuesIn(simd_targets()));
}  // namespace d2s1r::test
