// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <cstddef>
#include <vector>

namespace d2s1r::calibration
{
/// Signed distance to the surface of a wall and its gradient.
struct WallDistance
{
	double value = 0;                       //!< [m] below zero inside of a wall
	double gradient_x = 0, gradient_y = 0;  //!< [-] map frame
};

/// Tells the distance to the nearest surface of a wall, up to kReach cells, bilinear between the centres of cells. It
/// computes only the tiles of the map that are asked for. Not thread-safe.
class WallField
{
   public:
	static constexpr int kReach = 20;  //!< [cells] beyond, the distance is cut off

	/// \param map which must live as long as the field
	explicit WallField(const Grid& map)
	    : map_(map),
	      columns_(map.width / kTile + 3),
	      tiles_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(map.height / kTile + 3))
	{
	}

	WallDistance at(double x, double y);

   private:
	static constexpr int kTile = 32;  //!< [cells]

	const std::vector<float>& tile(int column, int row);
	double cell(int column, int row);
	std::vector<float> make_tile(int tile_column, int tile_row) const;

	const Grid& map_;
	int columns_;  //!< [tiles] of the map and a rim of one about it
	std::vector<std::vector<float>>
	    tiles_;  //!< [cells] row by row, the tile before the map's first; empty: not yet made
};
}  // namespace d2s1r::calibration
