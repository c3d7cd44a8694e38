// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "calibration/wall_field.h"

#include <algorithm>
#include <cmath>

namespace d2s1r::calibration
{
std::vector<float> WallField::make_tile(int tile_column, int tile_row) const
{
	constexpr int kSide = kTile + 2 * kReach;
	constexpr int kFar = kReach + 1;
	const int left = tile_column * kTile - kReach, bottom = tile_row * kTile - kReach;
	const auto is_wall = [&](int column, int row)
	{ return map_.contains(left + column, bottom + row) && map_.at(left + column, bottom + row) == Cell::kOccupied; };
	const auto at = [](int column, int row) { return static_cast<std::size_t>(row * kSide + column); };
	// [cells] along the column to the next wall, and to the next cell that is none.
	std::vector<int> to_wall(kSide * kSide, kFar), to_open(kSide * kSide, kFar);
	for (int column = 0; column < kSide; column++)
	{
		for (int step : {1, -1})
			for (int i = 0, wall = kFar, open = kFar; i < kSide; i++)
			{
				const int row = step > 0 ? i : kSide - 1 - i;
				const bool here = is_wall(column, row);
				wall = here ? 0 : std::min(kFar, wall + 1), open = here ? std::min(kFar, open + 1) : 0;
				to_wall[at(column, row)] = std::min(to_wall[at(column, row)], wall);
				to_open[at(column, row)] = std::min(to_open[at(column, row)], open);
			}
	}
	std::vector<float> tile(kTile * kTile);
	for (int row = 0; row < kTile; row++)
		for (int column = 0; column < kTile; column++)
		{
			const bool here = is_wall(column + kReach, row + kReach);
			const std::vector<int>& along = here ? to_open : to_wall;
			int square = kFar * kFar;
			for (int u = 0; u <= kReach && u * u < square; u++)
				for (const int beside : {column + kReach - u, column + kReach + u})
				{
					const int v = along[at(beside, row + kReach)];
					square = std::min(square, u * u + v * v);
				}
			const float distance = std::sqrt(static_cast<float>(square)) - 0.5F;  // to the edge of a cell
			tile[static_cast<std::size_t>(row * kTile + column)] = here ? -distance : distance;
		}
	return tile;
}

const std::vector<float>& WallField::tile(int column, int row)
{
	auto& tile = tiles_[static_cast<std::size_t>((row + 1) * columns_ + column + 1)];
	if (tile.empty()) tile = make_tile(column, row);
	return tile;
}

float WallField::cell(int column, int row)
{
	const int tile_column = (column + kTile) / kTile - 1, tile_row = (row + kTile) / kTile - 1;
	return tile(
	    tile_column,
	    tile_row)[static_cast<std::size_t>((row - tile_row * kTile) * kTile + column - tile_column * kTile)];
}

std::array<double, 4> WallField::corners(int column, int row)
{
	static_assert(kReach <= kTile && (kTile & (kTile - 1)) == 0);
	const int left = (column + kTile) % kTile, below = (row + kTile) % kTile;
	if (left + 1 < kTile && below + 1 < kTile)
	{
		const float* const at = tile((column - left) / kTile, (row - below) / kTile).data() + below * kTile + left;
		return {at[0], at[1], at[kTile], at[kTile + 1]};
	}
	return {cell(column, row), cell(column + 1, row), cell(column, row + 1), cell(column + 1, row + 1)};
}

WallDistance WallField::at(double x, double y)
{
	const double column = (x - map_.origin_x) / map_.cell_size - 0.5, row = (y - map_.origin_y) / map_.cell_size - 0.5;
	if (!(column >= -kReach && row >= -kReach && column < map_.width + kReach && row < map_.height + kReach))
		return {kReach * map_.cell_size, 0, 0};
	const int i = static_cast<int>(std::floor(column)), j = static_cast<int>(std::floor(row));
	const double u = column - i, v = row - j;
	const auto [a, b, c, d] = corners(i, j);
	const double lower = a + (b - a) * u, upper = c + (d - c) * u;
	return {map_.cell_size * (lower + (upper - lower) * v), (b - a) * (1 - v) + (d - c) * v, upper - lower};
}
}  // namespace d2s1r::calibration
