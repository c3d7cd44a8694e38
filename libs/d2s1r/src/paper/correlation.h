// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

namespace d2s1r
{
/// [-] How many values correlate() reads and writes beyond the last one.
inline constexpr std::size_t kCorrelationPadding = 64;

/// Computes result[s] = sum over i of weights[i] * circle[i + s] for all s below weights.size(). Every kind of SIMD
/// gives the same bits.
/// \param circle two turns of weights.size() values and kCorrelationPadding more
/// \param result weights.size() values and kCorrelationPadding more
void correlate(const std::vector<float>& weights, const std::vector<float>& circle, std::vector<float>& result);
}  // namespace d2s1r
