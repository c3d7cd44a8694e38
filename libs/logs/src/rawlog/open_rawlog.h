// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "logs/log.h"

namespace d2s1r::logs
{
/// Whether this build reads rawlogs.
extern const bool kReadsRawlogs;

/// Reads a rawlog to its end, or to where it is damaged, in a process of its own. Later only what has been read there
/// without harm is read again.
/// \throws LogError if it cannot be opened, std::bad_alloc if there is too little memory, Interrupted if `stop` said so
Log open_rawlog(const std::string& file, const Stop& stop, const Labels& left_out = {});
}  // namespace d2s1r::logs
