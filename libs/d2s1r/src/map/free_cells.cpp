// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map/free_cells.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace d2s1r
{
namespace
{
std::size_t at(CellIndex cell)
{
	return static_cast<std::size_t>(cell);
}

/// Fills `region` with the free cells connected to `start` by their sides and marks them in `seen`.
void collect_region(const Grid& grid, CellIndex start, std::vector<char>& seen, std::vector<CellIndex>& region)
{
	region.assign(1, start);
	seen[at(start)] = 1;
	for (std::size_t i = 0; i < region.size(); i++)
	{
		const int column = region[i] % grid.width, row = region[i] / grid.width;
		const auto visit = [&](int x, int y)
		{
			if (!grid.contains(x, y) || grid.at(x, y) != Cell::kFree || seen[at(grid.index(x, y))]) return;
			seen[at(grid.index(x, y))] = 1;
			region.push_back(grid.index(x, y));
		};
		visit(column - 1, row);
		visit(column + 1, row);
		visit(column, row - 1);
		visit(column, row + 1);
	}
}

/// Keeps the cells of the largest region; of regions of equal size, those of the one with the first cell.
void keep_largest_region(const Grid& grid, std::vector<CellIndex>& cells)
{
	std::vector<char> dropped(grid.cells.size(), 0);
	std::vector<CellIndex> region, largest;
	for (const CellIndex cell : cells)
	{
		if (dropped[at(cell)]) continue;
		collect_region(grid, cell, dropped, region);
		if (region.size() > largest.size()) largest.swap(region);
	}
	for (const CellIndex cell : largest) dropped[at(cell)] = 0;
	const auto is_dropped = [&](CellIndex cell) { return dropped[at(cell)] != 0; };
	cells.erase(std::remove_if(cells.begin(), cells.end(), is_dropped), cells.end());
}

/// Keeps the cells whose centre is at least `clearance` [m] from the centre of every occupied cell, exactly:
/// distances along columns first, then a search along the row, only as far as it matters.
void keep_clear_cells(const Grid& grid, double clearance, std::vector<CellIndex>& cells)
{
	const double in_cells = std::min(clearance / grid.cell_size, 60000.0);
	const auto reach = static_cast<int>(std::ceil(in_cells));
	const auto is_occupied = [&](int x, int y) { return grid.at(x, y) == Cell::kOccupied; };
	const auto distances =
	    distances_in_columns(grid.width, grid.height, is_occupied, 0, static_cast<std::uint16_t>(reach));
	const double least_squared = in_cells * in_cells * (1 - 1e-6);  // a distance of exactly the clearance will do
	const auto is_too_close = [&](CellIndex cell)
	{
		const int column = cell % grid.width, row = cell / grid.width;
		const int first = std::max(0, column - reach), last = std::min(grid.width - 1, column + reach);
		for (int x = first; x <= last; x++)
		{
			const double dy = distances[at(grid.index(x, row))], dx = x - column;
			if (dx * dx + dy * dy < least_squared) return true;
		}
		return false;
	};
	cells.erase(std::remove_if(cells.begin(), cells.end(), is_too_close), cells.end());
}
}  // namespace

std::vector<CellIndex> find_free_cells(const Grid& grid, const FreeCellParameters& parameters)
{
	std::vector<CellIndex> cells;
	cells.reserve(static_cast<std::size_t>(std::count(grid.cells.begin(), grid.cells.end(), Cell::kFree)));
	for (std::size_t i = 0; i < grid.cells.size(); i++)
		if (grid.cells[i] == Cell::kFree) cells.push_back(static_cast<CellIndex>(i));
	if (parameters.largest_region_only) keep_largest_region(grid, cells);
	if (parameters.clearance > 0) keep_clear_cells(grid, parameters.clearance, cells);
	return cells;
}

std::vector<CellIndex> find_sensor_cells(const Grid& grid, const FreeCellParameters& parameters)
{
	auto cells = find_free_cells(grid, parameters);
	if (cells.empty())
		throw std::invalid_argument(
		    "the map has no free cell a sensor can stand in; check its thresholds, free_cells.clearance "
		    "and free_cells.largest_region_only");
	return cells;
}

double count_free_squares(const Grid& grid, int side)
{
	std::vector<char> has_free(static_cast<std::size_t>(grid.width / side + 1));
	std::ptrdiff_t squares = 0;
	for (int y = 0; y < grid.height; y++)
	{
		for (int x = 0; x < grid.width; x++)
			if (grid.at(x, y) == Cell::kFree) has_free[static_cast<std::size_t>(x / side)] = 1;
		if ((y + 1) % side != 0 && y + 1 != grid.height) continue;
		squares += std::count(has_free.begin(), has_free.end(), 1);
		std::fill(has_free.begin(), has_free.end(), 0);
	}
	return static_cast<double>(squares);
}
}  // namespace d2s1r
