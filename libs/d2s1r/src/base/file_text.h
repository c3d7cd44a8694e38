// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>

namespace d2s1r
{
/// Returns the bytes of a file, but not more than `most`.
/// \throws std::runtime_error that does not name the file: why it cannot be read so far, and what to do
std::string read_text(const std::string& file, std::size_t most = std::string::npos);

/// Checks that the file of a map can be read.
/// \throws std::runtime_error that does not name `file`, if it is no file, is empty or cannot be read
void check_readable(const std::string& file);
}  // namespace d2s1r
