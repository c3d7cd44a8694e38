// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "logs/log.h"

namespace d2s1r::logs
{
/// Reads a log, and gives each scan the odometry at its time and during its beams. Unless the log is still being
/// written, an object is held back until the odometry after its scans has come, or the log has gone on for half a
/// second, or what waits takes more than ros::kMostBytesWaiting.
/// \param label of the laser whose scans tell which odometry is right
std::unique_ptr<LogReader> with_odometry(
    std::unique_ptr<LogReader> reader, const LogSurvey& survey, const std::string& label);
}  // namespace d2s1r::logs
