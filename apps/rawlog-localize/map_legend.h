// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "legend.h"
#include "map_png.h"

namespace d2s1r::app
{
/// What stands in the legend of map.png: the marks that are on it, and how many frames are not.
std::vector<LegendEntry> map_legend(const MapPicture& picture);
}  // namespace d2s1r::app
