// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/maps/COccupancyGridMap2D.h>

#include <string>

namespace d2s1r::experiments
{
/// Writes a map as NAME.png and NAME.yaml of map_server: 0 occupied, 205 unknown, 254 free. A margin of unknown cells
/// surrounds what is known.
/// \throws std::runtime_error if a file cannot be written
void save_map(const mrpt::maps::COccupancyGridMap2D& map, const std::string& name);
}  // namespace d2s1r::experiments
