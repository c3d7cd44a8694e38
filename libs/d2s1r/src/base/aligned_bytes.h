// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace d2s1r
{
inline constexpr std::size_t kCacheLine = 64;  //!< [byte]

/// Allocates memory that begins at a cache line.
template <class T>
struct CacheAligned
{
	using value_type = T;  // NOLINT(readability-identifier-naming): the name that allocators have

	CacheAligned() = default;
	template <class U>
	CacheAligned(const CacheAligned<U>&) noexcept
	{
	}
	T* allocate(std::size_t count)
	{
		return static_cast<T*>(::operator new (count * sizeof(T), std::align_val_t{kCacheLine}));
	}
	void deallocate(T* memory, std::size_t) noexcept { ::operator delete (memory, std::align_val_t{kCacheLine}); }
	friend bool operator==(const CacheAligned&, const CacheAligned&) noexcept { return true; }
	friend bool operator!=(const CacheAligned&, const CacheAligned&) noexcept { return false; }
};

/// Bytes that begin at a cache line. Rows of them do so, too, if they are in_whole_lines() apart.
using AlignedBytes = std::vector<std::uint8_t, CacheAligned<std::uint8_t>>;

/// Returns `count` [byte], rounded up to whole cache lines.
constexpr std::size_t in_whole_lines(std::size_t count)
{
	return (count + kCacheLine - 1) / kCacheLine * kCacheLine;
}
}  // namespace d2s1r
