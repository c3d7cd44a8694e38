// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/bytes.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace d2s1r::logs
{
using ros::ByteCursor;
using ros::Bytes;

/// Says how much [byte] is read into memory at once at most.
inline constexpr std::uint64_t kMostBytesAtOnce = std::uint64_t{1} << 26;

/// Unpacks bytes that were packed in one way, in parts that follow each other.
class Unpacker
{
   public:
	Unpacker() = default;
	Unpacker(const Unpacker&) = delete;
	Unpacker& operator=(const Unpacker&) = delete;
	virtual ~Unpacker() = default;

	/// Unpacks up to `count` bytes of a part. Returns how many. \param from what it has used is taken off it
	/// \throws std::runtime_error if the part is damaged, std::bad_alloc
	virtual std::size_t unpack(Bytes& from, std::uint8_t* to, std::size_t count) = 0;

	bool is_within_part() const { return is_within_part_; }  //!< a part has begun and not ended
	bool may_hold_more() const { return may_hold_more_; }    //!< of what it has been given, for want of room

   protected:
	bool is_within_part_ = false, may_hold_more_ = false;
};

/// Returns how bytes are packed by their first four, as make_unpacker() names it; empty if they are not.
std::string method_of(Bytes start);

/// \param method "gzip", "bz2", "lz4" or "zstd"
/// \throws Unreadable if it is another one, or this program was built without its library, std::bad_alloc
std::unique_ptr<Unpacker> make_unpacker(const std::string& method);

/// Unpacks what was packed as `method` says: "none" or "", or as make_unpacker() knows.
/// \param size [byte] of the result; no value: not known, and there is one part
/// \param ask_to_stop is called ten times a second or more often, and may throw
/// \throws std::runtime_error if the bytes are damaged or the result is larger than kMostBytesAtOnce, as make_unpacker()
std::vector<std::uint8_t> unpack(
    const std::string& method, Bytes packed, std::optional<std::uint64_t> size,
    const std::function<void()>& ask_to_stop = [] {});

/// \throws Unreadable that says that a part of a log is larger than kMostBytesAtOnce. \param what such as "chunk"
[[noreturn]] void throw_too_large(const std::string& what, std::uint64_t size);
}  // namespace d2s1r::logs
