// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace d2s1r
{
inline constexpr std::size_t kFileBlock = 1 << 16;  //!< [byte]

/// Reads a file in blocks of kFileBlock, the last of which may be shorter, so that its size does not matter for memory.
/// \param take takes a block, and returns whether it wants the next one
/// \throws std::runtime_error that does not name the file: why it cannot be read so far, and what to do
void read_blocks(const std::string& file, const std::function<bool(const char*, std::size_t)>& take);

/// Returns the bytes of a file, but not more than `most`.
/// \throws std::runtime_error that does not name the file: why it cannot be read so far, and what to do
std::string read_text(const std::string& file, std::size_t most = std::string::npos);

/// Checks that a file of a map can be read without waiting for it. Files of the system, below /proc, have no size: some
/// of them wait for what comes, and count as empty here.
/// \throws std::runtime_error that does not name `file`, if it is no file, is empty or cannot be read
void check_readable(const std::string& file);
}  // namespace d2s1r
