// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/grid.h>
#include <d2s1r/map_limits.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "map/cell_classes.h"

namespace d2s1r
{
namespace
{
/// Columns and rows [first, end) that hold known cells.
struct KnownArea
{
	int x0 = std::numeric_limits<int>::max(), x1 = 0;
	int y0 = std::numeric_limits<int>::max(), y1 = 0;
};

KnownArea find_known_area(const OccupancyMap& map, const CellClasses& classes)
{
	const int width = map.width, height = map.height;
	KnownArea area;
	for (int y = 0; y < height; y++)
	{
		const auto* row = map.row(y);
		const auto is_known = [&](int x) { return classes[row[x]] != Cell::kUnknown; };
		int first = 0, last = width - 1;
		while (first < width && !is_known(first)) first++;
		if (first == width) continue;
		while (last >= area.x1 && !is_known(last)) last--;  // cells that are in the area already need no look
		area.x0 = std::min(area.x0, first);
		area.x1 = std::max(area.x1, last + 1);
		area.y0 = std::min(area.y0, y);
		area.y1 = y + 1;
	}
	return area;
}

/// Returns where a map was meant to begin [m]. Maps keep their corner as a float, some micrometres off, so that
/// the same cells would be elsewhere with more unknown ones before them; files give tenths of a millimetre at most.
double without_rounding(double corner)
{
	constexpr double kSteps = 1e4;  // [1 / m]
	return std::round(corner * kSteps) / kSteps;
}
}  // namespace

Grid make_grid(const OccupancyMap& map, const GridParameters& parameters)
{
	if (parameters.free_threshold > parameters.occupied_threshold)
		throw std::invalid_argument("grid.free_threshold is above grid.occupied_threshold");
	if (map.width < 0 || map.height < 0 ||
	    map.cells.size() != static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height))
		throw std::invalid_argument("the map has not width times height cells; give each of them");
	if (!(static_cast<double>(map.cell_size) >= kLeastCellSize))
		throw std::invalid_argument("the cells of the map are below 6.3 mm; use larger ones");
	check_map_origin(static_cast<double>(map.origin_x), static_cast<double>(map.origin_y));
	const CellClasses classes(parameters);
	const KnownArea area = find_known_area(map, classes);
	if (area.x1 == 0) throw std::invalid_argument("the map has no free or occupied cell");

	Grid grid;
	grid.width = area.x1 - area.x0;
	grid.height = area.y1 - area.y0;
	const auto size = static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height);
	if (size > static_cast<std::size_t>(std::numeric_limits<CellIndex>::max()))
		throw std::invalid_argument("the map has more cells than can be numbered; use larger cells or a smaller map");
	grid.cell_size = static_cast<double>(map.cell_size);
	grid.origin_x = without_rounding(static_cast<double>(map.origin_x) + area.x0 * grid.cell_size);
	grid.origin_y = without_rounding(static_cast<double>(map.origin_y) + area.y0 * grid.cell_size);
	grid.cells.resize(size);
	auto cell = grid.cells.begin();
	for (int y = area.y0; y < area.y1; y++)
	{
		const auto* row = map.row(y);
		cell = std::transform(row + area.x0, row + area.x1, cell, [&](auto raw) { return classes[raw]; });
	}
	return grid;
}

Grid with_wall_surfaces_only(Grid grid)
{
	const int depth = std::max(1, static_cast<int>(std::lround(kWallThickness / grid.cell_size)));
	// 1 within `depth` cells of what is not occupied, along a row; then, row by row, along a column, too
	std::vector<std::uint8_t> by_row(grid.cells.size());
	for (int y = 0; y < grid.height; y++)
		for (int step = -depth; step <= depth; step++)
			for (int x = std::max(0, -step); x < std::min(grid.width, grid.width - step); x++)
			{
				std::uint8_t& near = by_row[static_cast<std::size_t>(grid.index(x, y))];
				near = static_cast<std::uint8_t>(near | (grid.at(x + step, y) != Cell::kOccupied ? 1 : 0));
			}
	const auto width = static_cast<std::size_t>(grid.width);
	std::vector<std::uint8_t> near(width);
	for (int y = 0; y < grid.height; y++)
	{
		std::fill(near.begin(), near.end(), std::uint8_t{0});
		for (int v = std::max(0, y - depth); v <= std::min(grid.height - 1, y + depth); v++)
		{
			const std::uint8_t* from = by_row.data() + static_cast<std::size_t>(v) * width;
			for (std::size_t x = 0; x < width; x++) near[x] = static_cast<std::uint8_t>(near[x] | from[x]);
		}
		Cell* const row = grid.cells.data() + static_cast<std::size_t>(y) * width;
		for (std::size_t x = 0; x < width; x++)
			if (row[x] == Cell::kOccupied && near[x] == 0) row[x] = Cell::kUnknown;
	}
	return grid;
}
}  // namespace d2s1r
