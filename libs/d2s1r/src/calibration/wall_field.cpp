// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "calibration/wall_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace d2s1r::calibration
{
std::vector<float> WallField::make_tile(int tile_column, int tile_row) const
{
	constexpr int kSide = kTile + 2 * kReach;
	constexpr std::int16_t kFar = kReach + 1;
	using Row = std::array<std::int16_t, kSide>;
	const int left = tile_column * kTile - kReach, bottom = tile_row * kTile - kReach;
	std::array<Row, kSide> walls{};  // 1 where a wall is
	for (int row = std::max(0, -bottom); row < std::min(kSide, map_.height - bottom); row++)
		for (int column = std::max(0, -left); column < std::min(kSide, map_.width - left); column++)
			walls[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] =
			    map_.at(left + column, bottom + row) == Cell::kOccupied;
	// [cells] from each cell along its column to the next one that is a wall, or that is none.
	const auto along_columns = [&](std::int16_t kind)
	{
		std::array<Row, kSide> along;
		for (auto& row : along) row.fill(kFar);
		const auto pass = [&](std::size_t row, const Row* before)
		{
			for (std::size_t i = 0; i < kSide; i++)
			{
				const auto next = static_cast<std::int16_t>(before ? (*before)[i] + 1 : kFar);
				along[row][i] = walls[row][i] == kind ? std::int16_t(0) : std::min(along[row][i], next);
			}
		};
		for (std::size_t row = 0; row < kSide; row++) pass(row, row > 0 ? &along[row - 1] : nullptr);
		for (std::size_t row = kSide; row-- > 0;) pass(row, row + 1 < kSide ? &along[row + 1] : nullptr);
		return along;
	};
	const std::array<Row, kSide> to_wall = along_columns(1), to_open = along_columns(0);
	// The squares of the distances, for a row of the tile.
	const auto squares_of = [](const Row& along)
	{
		std::array<std::int16_t, kTile> squares;
		squares.fill(kFar * kFar);
		for (std::size_t u = 0; u <= kReach; u++)
			for (std::size_t i = 0; i < kTile; i++)
			{
				const std::int16_t v = std::min(along[i + kReach - u], along[i + kReach + u]);
				squares[i] = std::min(squares[i], static_cast<std::int16_t>(static_cast<int>(u * u) + v * v));
			}
		return squares;
	};
	std::vector<float> tile;
	tile.reserve(kTile * kTile);
	for (std::size_t row = kReach; row < kReach + kTile; row++)
	{
		const auto outside = squares_of(to_wall[row]), inside = squares_of(to_open[row]);
		for (std::size_t i = 0; i < kTile; i++)
		{
			const bool here = walls[row][i + kReach] != 0;
			const float distance = std::sqrt(static_cast<float>(here ? inside[i] : outside[i])) - 0.5F;  // to its edge
			tile.push_back(here ? -distance : distance);
		}
	}
	return tile;
}

const std::vector<float>& WallField::tile(int column, int row)
{
	auto& tile = tiles_[static_cast<std::size_t>((row + 1) * columns_ + column + 1)];
	if (tile.empty()) tile = make_tile(column, row);
	return tile;
}

double WallField::cell(int column, int row)
{
	static_assert(kReach <= kTile);  // columns and rows begin at -kReach
	const int tile_column = (column + kTile) / kTile - 1, tile_row = (row + kTile) / kTile - 1;
	const int at = (row - tile_row * kTile) * kTile + column - tile_column * kTile;
	return static_cast<double>(tile(tile_column, tile_row)[static_cast<std::size_t>(at)]);
}

WallDistance WallField::at(double x, double y)
{
	const double column = (x - map_.origin_x) / map_.cell_size - 0.5, row = (y - map_.origin_y) / map_.cell_size - 0.5;
	if (!(column >= -kReach && row >= -kReach && column < map_.width + kReach && row < map_.height + kReach))
		return {kReach * map_.cell_size, 0, 0};
	const int i = static_cast<int>(std::floor(column)), j = static_cast<int>(std::floor(row));
	const double u = column - i, v = row - j;
	const double a = cell(i, j), b = cell(i + 1, j), c = cell(i, j + 1), d = cell(i + 1, j + 1);
	const double lower = a + (b - a) * u, upper = c + (d - c) * u;
	return {map_.cell_size * (lower + (upper - lower) * v), (b - a) * (1 - v) + (d - c) * v, upper - lower};
}
}  // namespace d2s1r::calibration
