// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/poses/CPose2D.h>

#include <vector>

namespace d2s1r::experiments
{
/// Holds a scan and where the robot was then.
struct PlacedScan
{
	mrpt::obs::CObservation2DRangeScan::Ptr scan;
	mrpt::poses::CPose2D robot;  //!< in map, m and rad
};

/// Draws a map by counting scans: a cell is occupied if more than a quarter of the scans that see it have a beam that
/// ends in it. Each scan counts once for a cell, so that a wall which many beams graze stays. Beams longer than `reach`
/// draw nothing.
/// \param cell_size [m]; `reach` [m]
mrpt::maps::COccupancyGridMap2D::Ptr count_map(const std::vector<PlacedScan>& scans, double cell_size, double reach);
}  // namespace d2s1r::experiments
