// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <cstddef>
#include <vector>

#include "base/array.h"

namespace d2s1r
{
/// Finds the cells of `grid` that a sensor can stand in (the passable grids of Algorithm 1), in increasing order; there
/// may be none. Thread-safe.
std::vector<CellIndex> find_free_cells(const Grid& grid, const FreeCellParameters& parameters);

/// Finds the same cells. \throws std::invalid_argument if there is none
std::vector<CellIndex> find_sensor_cells(const Grid& grid, const FreeCellParameters& parameters);

/// Counts the squares of `side` x `side` cells that have a free cell.
double count_free_squares(const Grid& grid, int side);

/// Returns the distance [cells] of every cell of a grid, and of a rim of `rim` cells about it, to the nearest occupied
/// cell of its column, at most `most`; row-major. The vector has room for `more` values after these.
/// \param is_occupied by column and row
/// \param most below the greatest T
template <class T, class IsOccupied>
std::vector<T, CacheAligned<T>> distances_in_columns(
    int columns, int rows, const IsOccupied& is_occupied, int rim, T most, std::size_t more = 0)
{
	const auto width = static_cast<std::size_t>(columns + 2 * rim);
	const auto height = static_cast<std::size_t>(rows + 2 * rim);
	std::vector<T, CacheAligned<T>> distances(width * height + more, most);
	for (int y = 0; y < rows; y++)
	{
		T* const row = distances.data() + static_cast<std::size_t>(y + rim) * width + rim;
		for (int x = 0; x < columns; x++)
			if (is_occupied(x, y)) row[x] = 0;
	}
	const auto relax = [&](std::size_t to, std::size_t from)
	{
		for (std::size_t x = 0; x < width; x++)
		{
			const auto step = static_cast<T>(distances[from + x] + 1);
			if (step < distances[to + x]) distances[to + x] = step;
		}
	};
	for (std::size_t y = 1; y < height; y++) relax(y * width, (y - 1) * width);
	for (std::size_t y = height; y > 1; y--) relax((y - 2) * width, (y - 1) * width);
	return distances;
}
}  // namespace d2s1r
