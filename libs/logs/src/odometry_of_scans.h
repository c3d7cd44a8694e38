// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "logs/log.h"

namespace d2s1r::logs
{
/// Reads a log, and gives each scan whose sweep is known the odometry during its beams.
/// \param waits whether an object is held back until the odometry after its scans has come, or the log has gone on for
/// half a second
std::unique_ptr<LogReader> with_odometry(std::unique_ptr<LogReader> reader, bool waits);
}  // namespace d2s1r::logs
