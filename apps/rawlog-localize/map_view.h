// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "canvas.h"

#include <d2s1r/grid.h>

namespace d2s1r::app
{
/// Where a map lies in a picture.
struct MapView
{
	double scale = 1;  //!< [pixel/m]
	double left = 0;   //!< [m] map frame, x of the left edge
	double top = 0;    //!< [m] map frame, y of the upper edge
	int offset_x = 0;  //!< [pixel] of the left edge
	int offset_y = 0;  //!< [pixel] of the upper edge
	int width = 0;     //!< [pixel] of the map
	int height = 0;    //!< [pixel] of the map

	Pixel pixel(double x, double y) const { return {offset_x + (x - left) * scale, offset_y + (top - y) * scale}; }
};

/// A view of the whole grid whose longer side is `long_side` pixels, but no cell larger than `largest_cell` pixels.
MapView fit_view(const Grid& grid, int long_side, double largest_cell);

/// Occupied dark, free white, unknown grey; thin walls stay visible when the map is scaled down.
void draw_map(const Grid& grid, const MapView& view, Canvas& canvas);
}  // namespace d2s1r::app
