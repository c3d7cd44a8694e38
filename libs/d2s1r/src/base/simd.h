// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

// Include this before Highway. The compiler makes portable loops and, on x86-64, loops for SSSE3, AVX2 and AVX-512; the
// machine chooses among them at run time. SSE4 is left out: it would gain next to nothing over SSSE3. On arm64 the
// compiler makes loops for NEON. SVE is left out: no struct can hold its vectors, and GCC 12.2 crashes on it.
#undef HWY_DISABLED_TARGETS  // Highway defines it where it was included before
#define HWY_DISABLED_TARGETS (HWY_SSE4 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)

namespace d2s1r
{
/// [-] Arrays that kernels read are padded to a multiple of this many floats.
inline constexpr std::size_t kSimdFloats = 8;

/// Fetches bytes that will be needed soon into the cache.
inline void prefetch(const std::uint8_t* bytes, std::size_t count)
{
	constexpr std::size_t kLine = 64;  // [byte]
	for (std::size_t i = 0; i < count; i += kLine) __builtin_prefetch(bytes + i);
	__builtin_prefetch(bytes + count - 1);
}
}  // namespace d2s1r
