// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <map>
#include <string>
#include <vector>

#include "recorded_drive.h"

namespace d2s1r::experiments
{
/// Simulates scans in a map: by name, sets of 500 scans each.
///   sim360_on       at poses of the drive, evenly spread
///   sim360_off      anywhere that the drive reaches through free space, with 0.3 m to walls and to what is unknown
///   sim360_clutter  at other such places, with eight people of radius 0.25 m, 0.7 to 4 m away, of whom walls hide some
///   sim270_off      at other such places, with a field of view of 270 deg
/// The laser stands in the middle of the robot, has a beam per degree and a reach of 30 m. Rays are followed exactly
/// from grid line to grid line; ranges have a noise of 0.01 m, among people 0.02 m (standard deviations).
/// \param driven robot in map
/// \throws std::runtime_error if no pose of `driven` has such a free place around it
std::map<std::string, std::vector<DrivenScan>> simulated_sets(
    const Grid& grid, const std::vector<mrpt::poses::CPose2D>& driven);
}  // namespace d2s1r::experiments
