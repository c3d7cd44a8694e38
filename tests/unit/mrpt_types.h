// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What test_maps.h makes, as MRPT's classes.
#pragma once

#include <d2s1r/mrpt.h>

#include "test_maps.h"

namespace d2s1r::test
{
/// The grid as a map of MRPT.
inline mrpt::maps::COccupancyGridMap2D::Ptr make_mrpt_map(const Grid& grid)
{
	return mrpt_grid_of(*make_map(grid));
}

inline mrpt::maps::COccupancyGridMap2D::Ptr make_mrpt_map(
    const Picture& picture, double cell_size, double origin_x = 0, double origin_y = 0)
{
	return make_mrpt_map(make_picture_grid(picture, cell_size, origin_x, origin_y));
}

/// What the laser "LASER" records at `robot` (map frame), see make_observation().
inline mrpt::obs::CObservation2DRangeScan make_mrpt_observation(
    const Grid& grid, const mrpt::math::TPose2D& robot, const Laser& laser = {})
{
	auto observation = observation_of(make_observation(grid, robot, laser));
	observation.sensorLabel = "LASER";
	return observation;
}
}  // namespace d2s1r::test
