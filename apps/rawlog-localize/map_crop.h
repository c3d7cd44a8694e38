// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>
#include <mrpt/math/TPoint2D.h>

#include <vector>

namespace d2s1r::app
{
/// The part of a map that is worth a picture: without the outer rows and columns that only a few stray rays reach, but
/// with all `points` [m, map frame] that lie in the map and a margin round them.
Grid crop_for_picture(const Grid& grid, const std::vector<mrpt::math::TPoint2D>& points);
}  // namespace d2s1r::app
