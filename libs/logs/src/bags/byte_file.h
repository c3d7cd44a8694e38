// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/bytes.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "logs/errors.h"

namespace d2s1r::logs
{
using ros::ByteCursor;
using ros::Bytes;

/// Throws Unreadable: the system failed to read a file on. \param reason of the system
[[noreturn]] void throw_unread(const std::string& reason);

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

/// Unpacks a whole frame of zstd, whether or not it tells its own size. \throws std::runtime_error as unpack()
std::vector<std::uint8_t> unpack_zstd_frame(Bytes packed);
bool is_zstd_frame(Bytes bytes);
}  // namespace d2s1r::logs
