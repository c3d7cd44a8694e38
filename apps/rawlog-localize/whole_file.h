// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// MRPT's writers do not tell when the disk is full; what stands at the end of a file does.
#pragma once

#include <string>

namespace d2s1r::app
{
/// Whether a gzip file unpacks to as many bytes as its end says, and not to none.
bool is_whole_gzip(const std::string& path);

/// Whether a PNG file ends as PNG files do.
bool is_whole_png(const std::string& path);
}  // namespace d2s1r::app
