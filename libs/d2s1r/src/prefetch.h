// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

namespace d2s1r
{
/// Fetches what will be looked at soon into the cache, line by line.
inline void prefetch(const std::uint8_t* bytes, std::size_t count)
{
	constexpr std::size_t kLine = 64;
	for (std::size_t i = 0; i < count; i += kLine) __builtin_prefetch(bytes + i);
}
}  // namespace d2s1r
