// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ranges/sweep_lines.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <numeric>

namespace d2s1r
{
namespace
{
constexpr double kTouch = 1e-9;  //!< [lines] so that rounding does not decide on which side a line passes a corner

std::uint16_t to_units(double columns)
{
	return static_cast<std::uint16_t>(std::lround(columns * kRangeUnitsPerCell));
}

/// The flags of cells, 1 for obstacles, and of a margin of one cell, in `columns` blocks of `rows` each.
struct Flags
{
	int columns = 0;
	int rows = 0;
	std::vector<std::uint8_t> values;

	Flags(int columns_, int rows_)
	    : columns(columns_), rows(rows_), values(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_))
	{
	}
	std::size_t index(int column, int row) const
	{
		return static_cast<std::size_t>(column) * static_cast<std::size_t>(rows) + static_cast<std::size_t>(row);
	}
};

Cell cell_or_unknown(const Grid& grid, int x, int y)
{
	return grid.contains(x, y) ? grid.at(x, y) : Cell::kUnknown;
}

/// Returns 1 for an occupied cell, unless no ray can enter it through an edge.
std::uint8_t obstacle_flag(const Grid& grid, int x, int y)
{
	if (cell_or_unknown(grid, x, y) != Cell::kOccupied) return 0;
	const Cell neighbours[] = {
	    cell_or_unknown(grid, x - 1, y), cell_or_unknown(grid, x + 1, y), cell_or_unknown(grid, x, y - 1),
	    cell_or_unknown(grid, x, y + 1)};
	const bool is_enclosed =
	    std::all_of(std::begin(neighbours), std::end(neighbours), [](Cell cell) { return cell == Cell::kOccupied; });
	return is_enclosed ? 0 : 1;
}

/// Returns the flags as sweeps along y need them: the grid's rows are the columns of the result.
Flags make_flags_along_y(const Grid& grid)
{
	Flags flags(grid.height + 2, grid.width + 2);
	for (int y = -1; y <= grid.height; y++)
		for (int x = -1; x <= grid.width; x++) flags.values[flags.index(y + 1, x + 1)] = obstacle_flag(grid, x, y);
	return flags;
}

Flags transposed(const Flags& flags)
{
	constexpr int kTile = 32;
	Flags result(flags.rows, flags.columns);
	for (int column = 0; column < flags.columns; column += kTile)
		for (int row = 0; row < flags.rows; row += kTile)
			for (int c = column; c < std::min(column + kTile, flags.columns); c++)
				for (int r = row; r < std::min(row + kTile, flags.rows); r++)
					result.values[result.index(r, c)] = flags.values[flags.index(c, r)];
	return result;
}

/// Returns the first row from `row` on whose flag is set, or `rows` if there is none.
int next_set(const std::uint8_t* column, int row, int rows)
{
	constexpr int kBytes = 8;
	for (; row + kBytes <= rows; row += kBytes)
	{
		std::uint64_t eight;
		std::memcpy(&eight, column + row, kBytes);
		if (eight != 0) break;
	}
	while (row < rows && column[row] == 0) row++;
	return row;
}

ColumnRuns find_runs(const Flags& flags)
{
	ColumnRuns result;
	std::size_t cells = 0;
	for (int c = 0; c < flags.columns; c++)
	{
		result.first.push_back(result.runs.size());
		result.cells_before.push_back(cells);
		const std::uint8_t* column = flags.values.data() + flags.index(c, 0);
		for (int row = next_set(column, 0, flags.rows); row < flags.rows;)
		{
			int end = row;
			while (end < flags.rows && column[end] != 0) end++;
			result.runs.push_back({row, end - row});
			cells += static_cast<std::size_t>(end - row);
			row = next_set(column, end, flags.rows);
		}
	}
	result.first.push_back(result.runs.size());
	result.cells_before.push_back(cells);
	return result;
}

/// Sorts `order` by `key_of` its elements, which is below `keys`: a stable counting sort.
template <class KeyOf>
std::vector<std::int32_t> sorted_by(const KeyOf& key_of, std::size_t keys, const std::vector<std::int32_t>& order)
{
	std::vector<std::int32_t> next(keys + 1);
	for (const std::int32_t i : order) next[key_of(i) + 1]++;
	std::partial_sum(next.begin(), next.end(), next.begin());
	std::vector<std::int32_t> sorted(order.size());
	for (const std::int32_t i : order) sorted[static_cast<std::size_t>(next[key_of(i)]++)] = i;
	return sorted;
}
}  // namespace

LineFamily::LineFamily(double slope, int columns, int rows) : slope_(slope)
{
	const auto climb = static_cast<std::ptrdiff_t>(std::ceil(std::abs(slope) * columns));
	first_ = kPhases * (slope > 0 ? climb + 2 : 2);
	size_ = static_cast<std::size_t>(kPhases * (rows + climb + 4));
}

/// A line that passes through a corner enters the cell beside it, so that none slips between diagonal neighbours.
std::ptrdiff_t LineFamily::near_line(int column) const
{
	return first_ + static_cast<std::ptrdiff_t>(std::ceil(-kPhases * slope_ * (column - 0.5) - kTouch));
}

ColumnCrossing LineFamily::crossing(int column) const
{
	ColumnCrossing c{};
	c.near_line = near_line(column);
	c.center_line = first_ + std::lround(kPhases * (0.5 - slope_ * column));
	c.center_at = to_units(column);
	c.near_at = to_units(column - 0.5);
	const std::ptrdiff_t next = near_line(column + 1);
	const bool climbs = next < c.near_line;
	c.side_line = climbs ? next : c.near_line + kPhases;
	c.side_lines = static_cast<std::size_t>(std::min<std::ptrdiff_t>(std::abs(next - c.near_line), kPhases));
	for (std::size_t i = 0; i < c.side_lines; i++)
	{
		const double line = static_cast<double>(c.side_line - first_) + static_cast<double>(i);
		const double side = climbs ? 0 : 1;  // of row 0
		c.side_at[i] = to_units(std::clamp((side - line / kPhases) / slope_, column - 0.5, column + 0.5));
	}
	return c;
}

SweepLayout find_obstacles(const Grid& grid)
{
	const Flags along_y = make_flags_along_y(grid);
	return {
	    {along_y.rows, along_y.columns, find_runs(transposed(along_y)), {}},
	    {along_y.columns, along_y.rows, find_runs(along_y), {}}};
}

PlacedCells place_cells(const std::vector<CellIndex>& cells, const Grid& grid, bool along_x)
{
	const auto cell = [&](std::int32_t i) { return cells[static_cast<std::size_t>(i)]; };
	const auto column = [&](std::int32_t i) { return static_cast<std::size_t>(cell(i) % grid.width); };
	const auto row = [&](std::int32_t i) { return static_cast<std::size_t>(cell(i) / grid.width); };
	const auto width = static_cast<std::size_t>(grid.width), height = static_cast<std::size_t>(grid.height);
	std::vector<std::int32_t> order(cells.size());
	std::iota(order.begin(), order.end(), 0);
	order = along_x ? sorted_by(column, width, sorted_by(row, height, order))
	                : sorted_by(row, height, sorted_by(column, width, order));
	const std::size_t columns = (along_x ? width : height) + 2;  // with the margin
	PlacedCells placed;
	placed.ranks.resize(cells.size());
	std::vector<Run>& runs = placed.runs.runs;
	std::int32_t rank = -1;
	CellIndex last = -1;
	const auto begin_columns = [&](std::size_t end)
	{
		for (auto& first = placed.runs.first; first.size() < end; first.push_back(runs.size()))
			placed.runs.cells_before.push_back(static_cast<std::size_t>(rank + 1));
	};
	for (const std::int32_t i : order)
	{
		if (cell(i) != last)
		{
			const std::size_t of_cell = (along_x ? column(i) : row(i)) + 1;
			const auto at = static_cast<std::int32_t>(along_x ? row(i) : column(i)) + 1;
			const bool is_new_column = placed.runs.first.size() <= of_cell;
			begin_columns(of_cell + 1);
			if (is_new_column || runs.back().row + runs.back().length != at) runs.push_back({at, 0});
			runs.back().length++;
			rank++;
		}
		last = cell(i);
		placed.ranks[static_cast<std::size_t>(i)] = rank;
	}
	begin_columns(columns + 1);
	return placed;
}
}  // namespace d2s1r
