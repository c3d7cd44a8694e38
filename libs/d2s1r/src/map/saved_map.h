// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/occupancy_map.h>

#include "base/index_file.h"

namespace d2s1r
{
/// The cells of a map in an index file.
struct SavedMap
{
	std::uint32_t width = 0, height = 0;  //!< [cells]
	float cell_size = 0;                  //!< [m]
	float origin_x = 0, origin_y = 0;     //!< [m] map frame, lower left corner
	Array<std::int8_t> cells;             //!< row-major

	template <class Self, class File>
	static void fields(Self& self, File& file)
	{
		geometry_fields(self, file);
		file(self.cells);
	}
};

/// Returns the cells of `map`, which they refer to.
SavedMap cells_of(const OccupancyMap& map);

OccupancyMap map_of(const SavedMap& saved);
}  // namespace d2s1r
