// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/maps/COccupancyGridMap2D.h>

#include "base/index_file.h"

namespace d2s1r
{
/// The cells of a map in an index file.
struct SavedMap
{
	std::uint32_t width = 0, height = 0;                     //!< [cells]
	float cell_size = 0;                                     //!< [m]
	float origin_x = 0, origin_y = 0;                        //!< [m] map frame, lower left corner
	Array<mrpt::maps::COccupancyGridMap2D::cellType> cells;  //!< row-major

	/// Lists what an index file holds of the map.
	template <class Self, class File>
	static void fields(Self& self, File& file)
	{
		geometry_fields(self, file);
		file(self.cells);
	}
};

/// Returns the cells of `map`, which they refer to.
SavedMap cells_of(const mrpt::maps::COccupancyGridMap2D& map);

/// Makes the map of its cells.
mrpt::maps::COccupancyGridMap2D::ConstPtr map_of(const SavedMap& saved);
}  // namespace d2s1r
