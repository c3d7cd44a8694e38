// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Texts of the command line -> values; whatever cannot stand there throws UserError (kWrongUse).
#pragma once

#include "flags.h"

namespace d2s1r::app
{
[[noreturn]] void wrong(const std::string& flag, const std::string& what);

void parse_frames(const std::string& text, Flags& flags);
int parse_threads(const std::string& text);
std::uint32_t parse_seed(const std::string& text);
std::optional<int> parse_window(const std::string& text);
Prior parse_region(const std::string& text);
double parse_time_budget(const std::string& text);  //!< [ms]
MotionSource parse_motion(const std::string& text, bool fuse);

/// No value without a resolution.
std::optional<ImageGeometry> parse_image(const std::string& resolution, const std::string& origin);
}  // namespace d2s1r::app
