// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>
#include <mrpt/math/TPoint2D.h>
#include <mrpt/math/TPose2D.h>

#include <cstdint>
#include <vector>

#include "frames/frame_store.h"
#include "picture/canvas.h"

namespace d2s1r::app
{
inline constexpr double kLeastDrawnProbability = 0.05;  //!< [-] of hypotheses that are drawn

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

/// Returns a view of the whole grid whose longer side is `long_side` pixels, but no cell larger than `largest_cell`
/// pixels.
MapView fit_view(const Grid& grid, int long_side, double largest_cell);

/// Returns a picture of the map, one grey value for each pixel, row by row from the top: occupied cells are dark, free
/// ones white and unknown ones grey. Thin walls stay visible when the map is scaled down.
std::vector<std::uint8_t> map_greys(const Grid& grid, const MapView& view);

/// Returns the part of a map that is worth a picture: without the outer rows and columns that only a few stray rays
/// reach, but with all `points` [m, map frame] that lie in the map and a margin round them.
Grid crop_for_picture(const Grid& grid, const std::vector<mrpt::math::TPoint2D>& points);

/// Returns whether no robot can drive from one pose to the other in that time: one of them is wrong, or the log jumps.
bool is_jump(const mrpt::math::TPose2D& from, const mrpt::math::TPose2D& to, double seconds);

/// Returns whether the particle filter went on from one frame to the other, which can be drawn as a line.
bool is_fused_onwards(const KeptFrame& from, const KeptFrame& to);

/// Returns the stretches of consecutive localized frames without a jump, which can be drawn as lines.
std::vector<std::vector<const KeptFrame*>> path_pieces(const std::vector<KeptFrame>& frames);
}  // namespace d2s1r::app
