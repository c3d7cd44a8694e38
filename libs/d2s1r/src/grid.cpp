// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/grid.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace d2s1r
{
namespace
{
Cell classify(float p_free, const GridParameters& parameters)
{
	const double p_occupied = 1.0 - static_cast<double>(p_free);
	if (p_occupied > parameters.occupied_threshold) return Cell::kOccupied;
	if (p_occupied < parameters.free_threshold) return Cell::kFree;
	return Cell::kUnknown;
}
}  // namespace

Grid make_grid(const mrpt::maps::COccupancyGridMap2D& map, const GridParameters& parameters)
{
	if (parameters.free_threshold > parameters.occupied_threshold)
		throw std::invalid_argument("grid.free_threshold is above grid.occupied_threshold");

	const int size_x = static_cast<int>(map.getSizeX());
	const int size_y = static_cast<int>(map.getSizeY());
	int x0 = size_x, x1 = -1, y0 = size_y, y1 = -1;
	for (int y = 0; y < size_y; y++)
		for (int x = 0; x < size_x; x++)
			if (classify(map.getCell(x, y), parameters) != Cell::kUnknown)
			{
				x0 = std::min(x0, x), x1 = std::max(x1, x);
				y0 = std::min(y0, y), y1 = std::max(y1, y);
			}
	if (x1 < 0) throw std::invalid_argument("the map has no free or occupied cell");

	Grid grid;
	grid.width = x1 - x0 + 1;
	grid.height = y1 - y0 + 1;
	grid.cell_size = static_cast<double>(map.getResolution());
	grid.origin_x = static_cast<double>(map.getXMin()) + x0 * grid.cell_size;
	grid.origin_y = static_cast<double>(map.getYMin()) + y0 * grid.cell_size;
	grid.cells.reserve(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height));
	for (int y = y0; y <= y1; y++)
		for (int x = x0; x <= x1; x++) grid.cells.push_back(classify(map.getCell(x, y), parameters));
	return grid;
}
}  // namespace d2s1r
