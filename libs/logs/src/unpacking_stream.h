// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/io/CStream.h>

#include <limits>
#include <memory>
#include <stdexcept>

#include "logs/errors.h"

namespace d2s1r::logs
{
/// A stream that can only be read, and has no positions.
class InputStream : public mrpt::io::CStream
{
   public:
	std::size_t Write(const void*, std::size_t) override { throw std::logic_error("read-only stream"); }
	std::uint64_t Seek(std::int64_t, TSeekOrigin) override { throw std::logic_error("stream without positions"); }
	std::uint64_t getTotalBytesCount() const override { return std::numeric_limits<std::uint64_t>::max(); }
	std::uint64_t getPosition() const override { return 0; }
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

/// Returns what comes from a pipe or a file, unpacked if gzip or zstd has packed it. A read waits until there is
/// something, but not until its buffer is full, as the readers of zlib and MRPT do. Unlike these it tells damage, a
/// part that ends early (CutShort), a file that somebody cuts while it is followed (BecameShorter), a read that failed
/// (ReadError) and memory that ran out (std::bad_alloc) apart. \param descriptor is closed with the stream
/// \param follows whether to wait for more at the end of the file, until it is removed
std::unique_ptr<InputStream> unpack(int descriptor, bool follows);
}  // namespace d2s1r::logs
