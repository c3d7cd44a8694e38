// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Generated floors that are alike but for some of their walls, and scans of them.
#pragma once

#include <d2s1r/grid.h>
#include <d2s1r/mrpt.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/math/TPose2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>

#include <random>

#include "ranges/ray_caster.h"

namespace d2s1r::experiments
{
/// Takes 5 % of the walls of a floor away, or puts new ones into its rooms, in pieces of 1.5 m.
Grid altered(const Grid& floor, unsigned seed);

/// Returns the map of a floor.
std::shared_ptr<const OccupancyMap> map_of(const Grid& grid);

/// Returns whether there is nothing within 0.3 m of a cell.
bool is_open(const Grid& grid, int column, int row);

/// Returns a pose somewhere in the open space of a floor.
mrpt::math::TPose2D open_pose_on(const Grid& grid, std::mt19937& random);

/// Returns a scan by the exact rays of a floor, up to 30 m, with 1 cm of noise.
/// \param field_of_view [deg] a beam for each
mrpt::obs::CObservation2DRangeScan::Ptr scan_of(
    const RayCaster& caster, const mrpt::math::TPose2D& pose, double field_of_view, std::mt19937& random);

/// Returns whether a scan at `pose` would show no difference between two floors: less than 5 % of its beams differ by
/// more than 0.1 m.
bool look_alike(const Grid& a, const Grid& b, const mrpt::math::TPose2D& pose, double field_of_view);
}  // namespace d2s1r::experiments
