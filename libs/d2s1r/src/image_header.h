// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace d2s1r
{
/// Looks at a PNG, JPEG or PNM file before a decoder does, which would write to stderr, take a truncated file, or
/// allocate whatever the header says. Other formats pass.
/// \throws std::runtime_error if the file cannot be read, is empty, truncated, too large for memory, or a PNM
///         whose samples are not of 8 or 16 bit
void check_image_header(const std::string& file);
}  // namespace d2s1r
