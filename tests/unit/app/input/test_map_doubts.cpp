// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "input/map_doubts.h"
#include "mrpt_types.h"
#include "test_files.h"

namespace d2s1r::test
{
namespace
{
constexpr double kCell = 0.05;  // [m]

/// The plan of a flat of 9 m x 7 m, whose walls are 0.2 m thick. \return row by row, 'true' is a wall
std::vector<std::vector<bool>> plan()
{
	constexpr int kWidth = 180, kHeight = 140, kThick = 4;
	std::vector<std::vector<bool>> walls(kHeight, std::vector<bool>(kWidth));
	const auto draw = [&](int x0, int y0, int x1, int y1)
	{
		for (int y = y0; y < y1; y++)
			for (int x = x0; x < x1; x++) walls[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] = true;
	};
	draw(60, 0, 60 + kThick, 50), draw(60, 70, 60 + kThick, kHeight);
	draw(120, 20, 120 + kThick, 110);
	draw(0, 70, 40, 70 + kThick), draw(80, 50, 165, 50 + kThick);
	return walls;
}

/// Returns `walls` in an image whose border is a wall, too. \param grow [cells] by how much walls grow to every side
Grid grid_of(const std::vector<std::vector<bool>>& walls, const std::function<double(int, int)>& grow)
{
	const int height = static_cast<int>(walls.size()), width = static_cast<int>(walls[0].size());
	Picture picture(walls.size(), std::string(walls[0].size(), '.'));
	for (int y = 0; y < height; y++)
		for (int x = 0; x < width; x++)
		{
			const double growth = grow(x, y);
			const int reach = static_cast<int>(growth);
			bool is_wall = x == 0 || y == 0 || x == width - 1 || y == height - 1;
			for (int v = std::max(0, y - reach); v <= std::min(height - 1, y + reach); v++)
				for (int u = std::max(0, x - reach); u <= std::min(width - 1, x + reach); u++)
					is_wall = is_wall || (walls[static_cast<std::size_t>(v)][static_cast<std::size_t>(u)] &&
					                      std::hypot(u - x, v - y) <= growth);
			if (is_wall) picture[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] = '#';
		}
	return make_picture_grid(picture, kCell);
}

std::string doubts_about(const Grid& grid)
{
	std::string lines;
	for (const std::string& line : app::doubts_about_map("flat.gridmap", Localizer(make_map(grid))))
		lines += line + "\n";
	return lines;
}
}  // namespace

TEST(MapDoubts, WallsThatGrewUnevenlyAreSmeared)
{
	for (const unsigned seed : {1U, 2U, 3U})
	{
		std::mt19937 random(seed);
		std::uniform_real_distribution<double> phase(0, 6);
		const double a = phase(random), b = phase(random);
		const auto walls = plan();
		auto thin = walls;  // as a laser draws them, one cell thick
		for (std::size_t y = 1; y < thin.size(); y++)
			for (std::size_t x = 1; x < thin[0].size(); x++)
				thin[y][x] = walls[y][x] && !(walls[y - 1][x] && walls[y][x - 1]);
		const Grid grid =
		    grid_of(thin, [&](int x, int y) { return 2 + 1.2 * std::sin(0.31 * x + a) * std::cos(0.23 * y + b); });
		EXPECT_NE(doubts_about(grid).find("it is smeared"), std::string::npos) << seed;
	}
}
}  // namespace d2s1r::test
