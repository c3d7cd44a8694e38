// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The program without cairo.
#include "picture/map_png.h"

namespace d2s1r::app
{
const bool kDrawsMapPng = false;

void write_map_png(
    const RunReport& /*report*/, const DrawnFrames& /*frames*/, const Grid& /*map*/,
    const std::vector<MapName>& /*names*/, const PendingFile& /*file*/)
{
}
}  // namespace d2s1r::app
