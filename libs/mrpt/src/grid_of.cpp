// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/CSignatureMap2D.h>
#include <d2s1r/mrpt.h>
#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/maps/CSimpleMap.h>

#include <stdexcept>

#include "mrpt_grid.h"

namespace d2s1r
{
using mrpt::maps::COccupancyGridMap2D;

namespace
{
std::shared_ptr<const OccupancyMap> cells_of(const COccupancyGridMap2D& grid)
{
	const auto& cells = grid.getRawMap();
	return std::make_shared<const OccupancyMap>(OccupancyMap{
	    static_cast<int>(grid.getSizeX()),
	    static_cast<int>(grid.getSizeY()),
	    grid.getResolution(),
	    grid.getXMin(),
	    grid.getYMin(),
	    {cells.begin(), cells.end()}});
}
}  // namespace

std::shared_ptr<const OccupancyMap> grid_of(
    const mrpt::serialization::CSerializable& map, const GridParameters& parameters)
{
	if (const auto* grid = dynamic_cast<const COccupancyGridMap2D*>(&map)) return cells_of(*grid);
	if (const auto* keyframes = dynamic_cast<const mrpt::maps::CSimpleMap*>(&map))
		return cells_of(*draw_simple_map(*keyframes, parameters.simplemap_cell_size));
	if (const auto* maps = dynamic_cast<const mrpt::maps::CMultiMetricMap*>(&map))
	{
		if (const auto grid = maps->mapByClass<COccupancyGridMap2D>()) return grid_of(*grid, parameters);
		if (const auto signature_map = maps->mapByClass<CSignatureMap2D>()) return grid_of(*signature_map, parameters);
	}
	if (const auto* signature_map = dynamic_cast<const CSignatureMap2D*>(&map))
		if (!signature_map->isEmpty()) return cells_of(*signature_map->grid());
	throw std::invalid_argument(
	    std::string("an object of class ") + map.GetRuntimeClass()->className +
	    " that holds no occupancy grid; give a map with one");
}
}  // namespace d2s1r
