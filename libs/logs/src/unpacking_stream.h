// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>

#include "logs/errors.h"

namespace d2s1r::logs
{
/// What is read from its start to its end.
class InputStream
{
   public:
	virtual ~InputStream() = default;

	/// Returns how many bytes it has read, fewer than `count` only at the end.
	virtual std::size_t read(void* buffer, std::size_t count) = 0;
};

/// Says that a part of a packed file ends early.
class CutShort : public std::runtime_error
{
   public:
	CutShort() : std::runtime_error("packed data is not whole") {}
};

/// Says that a file has become shorter while it was followed.
class BecameShorter : public std::runtime_error
{
   public:
	BecameShorter() : std::runtime_error("the file has become shorter") {}
};

/// Returns what comes from a pipe or a file, unpacked if gzip, bzip2 or zstd has packed it. A read waits until there is
/// something, but not until its buffer is full, as the readers of zlib and MRPT do. Unlike these it tells damage, a
/// part that ends early (CutShort), a file that somebody cuts while it is followed (BecameShorter), a read that failed
/// (ReadError) and memory that ran out (std::bad_alloc) apart. \param descriptor is closed with the stream
/// \param follows whether to wait for more at the end of the file, until it is removed
std::unique_ptr<InputStream> unpack(int descriptor, bool follows);

/// Opens a file that may be packed. \throws LogError if it cannot be opened
std::unique_ptr<InputStream> open_unpacked(const std::string& path);

/// Returns up to `size` [byte] of the start of a file, unpacked.
std::string read_unpacked_start(const std::string& path, std::size_t size);
}  // namespace d2s1r::logs
