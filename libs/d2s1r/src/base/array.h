// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace d2s1r
{
inline constexpr std::size_t kCacheLine = 64;  //!< [byte]

/// Allocates memory that begins at a cache line. Large arrays are asked to be in large pages: a query reads few bytes
/// here and there, and the processor would look up the page of nearly each of them.
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
		void* const memory = ::operator new(count * sizeof(T), alignment(count));
		if (is_large(count))
			madvise(memory, count * sizeof(T), MADV_HUGEPAGE);  // if it fails, queries only take longer
		return static_cast<T*>(memory);
	}
	void deallocate(T* memory, std::size_t count) noexcept { ::operator delete(memory, alignment(count)); }
	friend bool operator==(const CacheAligned&, const CacheAligned&) noexcept { return true; }
	friend bool operator!=(const CacheAligned&, const CacheAligned&) noexcept { return false; }

   private:
	static constexpr std::size_t kLargePage = std::size_t{1} << 21;  //!< [byte] of x86-64 and arm64

	static constexpr bool is_large(std::size_t count) { return count * sizeof(T) >= 2 * kLargePage; }
	static constexpr std::align_val_t alignment(std::size_t count)
	{
		return std::align_val_t{is_large(count) ? kLargePage : kCacheLine};
	}
};

/// Bytes that begin at a cache line. Rows of them do so, too, if they are in_whole_lines() apart.
using AlignedBytes = std::vector<std::uint8_t, CacheAligned<std::uint8_t>>;

/// Returns `count` [byte], rounded up to whole cache lines.
constexpr std::size_t in_whole_lines(std::size_t count)
{
	return (count + kCacheLine - 1) / kCacheLine * kCacheLine;
}

/// An array that is not changed any more. It was made here, from a vector, or it is a part of a file that is mapped
/// into memory. Copies share it.
template <class T>
class Array
{
   public:
	Array() = default;

	/// Takes the values of a vector. It is implicit because vectors are what arrays are made in.
	template <class Allocator>
	Array(std::vector<T, Allocator>&& values)
	{
		const auto owned = std::make_shared<const std::vector<T, Allocator>>(std::move(values));
		*this = Array(owned->data(), owned->size(), owned);
	}

	/// Refers to values that live as long as `owner`.
	Array(const T* values, std::size_t count, std::shared_ptr<const void> owner)
	    : values_(values), size_(count), owner_(std::move(owner))
	{
	}

	const T* data() const { return values_; }
	std::size_t size() const { return size_; }
	bool empty() const { return size_ == 0; }
	const T& operator[](std::size_t i) const { return values_[i]; }
	const T& front() const { return values_[0]; }
	const T& back() const { return values_[size_ - 1]; }
	const T* begin() const { return values_; }
	const T* end() const { return values_ + size_; }

   private:
	const T* values_ = nullptr;
	std::size_t size_ = 0;
	std::shared_ptr<const void> owner_;
};
}  // namespace d2s1r
