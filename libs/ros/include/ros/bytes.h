// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Reading of bytes whose counts and lengths may be wrong.
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

namespace d2s1r::ros
{
/// Bytes that somebody else owns.
struct Bytes
{
	const std::uint8_t* data = nullptr;
	std::size_t size = 0;
};

/// Takes little-endian numbers and texts from bytes, one after the other.
class ByteCursor
{
   public:
	explicit ByteCursor(Bytes bytes) : at_(bytes.data), left_(bytes.size) {}

	std::size_t left() const { return left_; }

	/// \throws std::runtime_error if fewer bytes are left
	Bytes take(std::uint64_t size)
	{
		if (size > left_) throw std::runtime_error("a length in the file reaches beyond the end of its record");
		const Bytes taken{at_, static_cast<std::size_t>(size)};
		at_ += size;
		left_ -= taken.size;
		return taken;
	}

	template <typename Number>
	Number number()
	{
		static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers are copied as they stand in the file");
		Number value;
		std::memcpy(&value, take(sizeof value).data, sizeof value);
		return value;
	}

	/// A text after its length, which is a number of 32 bits.
	std::string text()
	{
		const Bytes taken = take(number<std::uint32_t>());
		return {reinterpret_cast<const char*>(taken.data), taken.size};
	}

   private:
	const std::uint8_t* at_;
	std::size_t left_;
};
}  // namespace d2s1r::ros
