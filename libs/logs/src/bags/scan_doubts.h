// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What is wrong with the fields of a laser's messages.
#pragma once

#include <ros/observation.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "logs/log.h"

namespace d2s1r::logs
{
/// Returns the fields that cannot be right or contradict each other, a line each.
std::vector<ScanDoubt> doubts_about_fields(const ros::LaserScan& scan);

/// Returns the angles of the beams as the other fields of a message have them, if its usual ones are doubtful.
std::optional<OtherAngles> other_angles_of(const ros::LaserScan& scan);

}  // namespace d2s1r::logs
