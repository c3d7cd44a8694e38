// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "logs/log.h"

namespace d2s1r::logs
{
/// Returns whether a text looks like the start of a CARMEN log.
bool is_carmen_text(const std::string& start);

/// Opens a CARMEN log, plain or packed by gzip or bzip2: lasers FLASER, RLASER and ROBOTLASER1, odometry from their
/// lines and from ODOM. It is read once.
/// \param stop as open_log() has it
/// \throws LogError, Interrupted if `stop` said so
Log open_carmen_log(
    const std::string& path, const Stop& stop = [] { return false; });
}  // namespace d2s1r::logs
