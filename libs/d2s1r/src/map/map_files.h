// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace d2s1r
{
/// Checks that a file can be read.
/// \throws std::runtime_error that does not name `file`, if it is no file, is empty or cannot be read
void check_readable(const std::string& file);
}  // namespace d2s1r
