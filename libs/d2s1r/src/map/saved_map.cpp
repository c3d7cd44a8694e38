// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map/saved_map.h"

namespace d2s1r
{
SavedMap cells_of(const OccupancyMap& map)
{
	return {
	    static_cast<std::uint32_t>(map.width),
	    static_cast<std::uint32_t>(map.height),
	    map.cell_size,
	    map.origin_x,
	    map.origin_y,
	    {map.cells.data(), map.cells.size(), nullptr}};
}

OccupancyMap map_of(const SavedMap& saved)
{
	return {
	    static_cast<int>(saved.width),
	    static_cast<int>(saved.height),
	    saved.cell_size,
	    saved.origin_x,
	    saved.origin_y,
	    {saved.cells.data(), saved.cells.data() + saved.cells.size()}};
}
}  // namespace d2s1r
