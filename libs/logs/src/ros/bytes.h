// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Reading of bytes whose counts and lengths may be wrong.
#pragma once

#include "logs/errors.h"

#include <cstdint>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace d2s1r::logs
{
/// Bytes that somebody else owns.
struct Bytes
{
	const std::uint8_t* data = nullptr;
	std::size_t size = 0;
};

/// A file is not damaged, but cannot be read; the text is a predicate of it, and says what to do.
class Unreadable : public std::runtime_error
{
   public:
	explicit Unreadable(const std::string& what) : std::runtime_error(printable(what)) {}
};

/// Throws Unreadable: the system failed to read a file on. \param reason of the system
[[noreturn]] void throw_unread(const std::string& reason);

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

/// A file of which parts are read in any order; remembers the surroundings of the last one.
class ByteFile
{
   public:
	/// \throws LogError
	explicit ByteFile(const std::string& path);
	~ByteFile();
	ByteFile(const ByteFile&) = delete;
	ByteFile& operator=(const ByteFile&) = delete;

	std::uint64_t size() const { return size_; }

	/// Returns a part of the file; it is valid until the next call.
	/// \throws std::runtime_error if the file ends before, Unreadable if it cannot be read
	Bytes view(std::uint64_t offset, std::uint64_t size);

   private:
	void fill_window(std::uint64_t offset, std::uint64_t size);

	int descriptor_;
	std::uint64_t size_ = 0;   //!< [byte]
	std::uint64_t start_ = 0;  //!< [byte] of the window in the file
	std::vector<std::uint8_t> window_;
};

/// Returns the first 16 bytes of a file, which tell what it is, or all of a shorter one.
/// \throws LogError if it cannot be read
std::string first_bytes(const std::string& path);

/// Says how much [byte] is read into memory at once at most.
inline constexpr std::uint64_t kMostBytesAtOnce = std::uint64_t{1} << 26;

/// Unpacks what was packed as `method` says: "none" or "", "bz2", "lz4" or "zstd".
/// \param size [byte] of the result
/// \param ask_to_stop is called ten times a second or more often, and may throw
/// \throws std::runtime_error if the bytes are damaged, the result is larger than kMostBytesAtOnce or this program was
/// built without the library, std::bad_alloc
std::vector<std::uint8_t> unpack(
    const std::string& method, Bytes packed, std::uint64_t size, const std::function<void()>& ask_to_stop = [] {});

/// A whole frame of zstd that tells its own size. \throws std::runtime_error as unpack()
std::vector<std::uint8_t> unpack_zstd_frame(Bytes packed);
bool is_zstd_frame(Bytes bytes);
}  // namespace d2s1r::logs
