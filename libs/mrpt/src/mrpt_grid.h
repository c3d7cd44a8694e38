// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/mrpt.h>
#include <mrpt/maps/CSimpleMap.h>

namespace d2s1r
{
/// Moves the lower left corner of `map` to exactly (x, y) [m, map frame].
void set_origin(mrpt::maps::COccupancyGridMap2D& map, double x, double y);

/// Makes a small map of unknown cells about a robot (map frame), to draw into.
/// \param cell_size [m]
/// \throws std::runtime_error, std::invalid_argument if the pose is not finite or too far from the origin
mrpt::maps::COccupancyGridMap2D::Ptr make_map_around(const mrpt::poses::CPose3D& robot, double cell_size);

/// Draws an observation of a robot (map frame) with the options of `map`, which grows where it needs to.
/// \return whether it was drawn: 2D scans in the plane of the map are
/// \throws std::runtime_error if it holds numbers that are not finite, or the map would become too large for memory
bool draw(
    const mrpt::obs::CObservation& observation, const mrpt::poses::CPose3D& robot,
    mrpt::maps::COccupancyGridMap2D& map);

/// Draws the 2D scans of a simplemap with MRPT's default insertion options.
/// \param cell_size [m]
/// \throws std::runtime_error if it is too large for memory
mrpt::maps::COccupancyGridMap2D::Ptr draw_simple_map(const mrpt::maps::CSimpleMap& keyframes, double cell_size);
}  // namespace d2s1r
