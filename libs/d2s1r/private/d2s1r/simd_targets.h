// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace d2s1r
{
/// Returns the SIMD targets that this machine runs and the library was compiled for, the one in use first: "avx3"
/// (AVX-512), "avx2", "ssse3", "neon" or "portable". Results are the same with each of them, bit for bit.
std::vector<std::string> simd_targets();

/// Makes the library use one of simd_targets() from here on. Call it before any other thread runs.
/// \throws std::invalid_argument if the machine or the library lacks it
void use_simd_target(const std::string& name);
}  // namespace d2s1r
