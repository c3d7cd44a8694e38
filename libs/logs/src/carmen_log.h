// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "logs/log.h"

namespace d2s1r::logs
{
/// Returns whether a text looks like the start of a CARMEN log.
bool is_carmen_text(const std::string& start);

/// Returns the first bytes of a file, unpacked if it is packed by gzip or bzip2.
/// \throws std::runtime_error if they cannot be read
std::string read_unpacked_start(const std::string& path, std::size_t size);

/// Opens a CARMEN log, plain or packed by gzip or bzip2: lasers FLASER, RLASER and ROBOTLASER1, odometry from their
/// lines and from ODOM. It is read once.
/// \throws LogError
Log open_carmen_log(const std::string& path);
}  // namespace d2s1r::logs
