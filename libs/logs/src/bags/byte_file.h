// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "unpacker.h"

namespace d2s1r::logs
{
/// Throws Unreadable: the system failed to read a file on. \param reason of the system
[[noreturn]] void throw_unread(const std::string& reason);

/// A file of which parts are read in any order; remembers the surroundings of the last one.
class ByteFile
{
   public:
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
}  // namespace d2s1r::logs
