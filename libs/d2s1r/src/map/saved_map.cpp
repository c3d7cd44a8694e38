// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map/saved_map.h"

#include <algorithm>

#include "map/occupancy_map.h"

namespace d2s1r
{
SavedMap cells_of(const mrpt::maps::COccupancyGridMap2D& map)
{
	const auto& cells = map.getRawMap();
	return {map.getSizeX(), map.getSizeY(), map.getResolution(),
	        map.getXMin(),  map.getYMin(),  {cells.data(), cells.size(), nullptr}};
}

mrpt::maps::COccupancyGridMap2D::ConstPtr map_of(const SavedMap& saved)
{
	auto map = make_unknown_map(
	    static_cast<int>(saved.width), static_cast<int>(saved.height), static_cast<double>(saved.cell_size),
	    static_cast<double>(saved.origin_x), static_cast<double>(saved.origin_y));
	for (std::uint32_t row = 0; row < saved.height; row++)
		std::copy_n(
		    saved.cells.data() + std::size_t{row} * saved.width, saved.width, map->getRow(static_cast<int>(row)));
	return map;
}
}  // namespace d2s1r
