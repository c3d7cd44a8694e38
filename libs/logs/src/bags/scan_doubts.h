// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What is wrong with the fields of a laser's messages.
#pragma once

#include <ros/observation.h>

#include <cstdint>
#include <string>
#include <vector>

#include "logs/log.h"

namespace d2s1r::logs
{
/// Returns the fields that cannot be right or contradict each other, a line each.
std::vector<ScanDoubt> doubts_about_fields(const ros::LaserScan& scan);
}  // namespace d2s1r::logs
