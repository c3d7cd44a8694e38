// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The walk of app_world.h in formats that are not MRPT's.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "logs/made_logs.h"

namespace d2s1r::test
{
/// Returns walk_scan(i) as ROS has it, from beams that start at -pi. \param clockwise as a laser upside down gives it
MadeScan ros_scan(std::size_t i, bool clockwise = false);

/// Returns the walk with odometry, and the laser where walk_scan() has it.
std::vector<MadeMessage> ros_walk(Wire wire, bool upside_down = false);

/// Returns the walk as a CARMEN log with odometry that is always zero.
std::string carmen_walk();
}  // namespace d2s1r::test
