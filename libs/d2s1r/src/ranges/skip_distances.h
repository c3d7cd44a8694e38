// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace d2s1r
{
/// [byte] How far kernels read behind the last cell of a map, because they gather cells as words of four bytes.
inline constexpr std::size_t kGatherOverrun = 3;

/// Returns the skip distance of each cell of a map: the Chebyshev distance [cells] to the nearest cell of another
/// class, at most `most`, and 0 in a margin of one cell, which counts as another class. kGatherOverrun bytes follow.
/// \param classes row-major, with the margin
/// \param width [cells] with the margin
std::vector<std::uint8_t> skip_distances(const std::vector<std::uint8_t>& classes, int width, int most);
}  // namespace d2s1r
