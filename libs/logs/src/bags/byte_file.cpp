// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "bags/byte_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <new>

#include "logs/errors.h"

namespace d2s1r::logs
{
void throw_unread(const std::string& reason)
{
	throw Unreadable("cannot be read any further (" + reason + "); check the disk or the connection");
}

ByteFile::ByteFile(const std::string& path) : descriptor_(open(path.c_str(), O_RDONLY | O_CLOEXEC))
{
	if (descriptor_ < 0) throw cannot_open(path);
	struct stat status
	{
	};
	if (fstat(descriptor_, &status) == 0) size_ = static_cast<std::uint64_t>(status.st_size);
}

ByteFile::~ByteFile()
{
	close(descriptor_);
}

Bytes ByteFile::view(std::uint64_t offset, std::uint64_t size)
{
	if (offset > size_ || size > size_ - offset) throw std::runtime_error("it ends within a record");
	if (size > kMostBytesAtOnce) throw_too_large("record", size);
	if (offset < start_ || offset + size > start_ + window_.size()) fill_window(offset, size);
	return {window_.data() + (offset - start_), static_cast<std::size_t>(size)};
}

void ByteFile::fill_window(std::uint64_t offset, std::uint64_t size)
{
	constexpr std::uint64_t kReadAhead = 1 << 18;  // [byte]
	window_.resize(static_cast<std::size_t>(std::min(size_ - offset, std::max(size, kReadAhead))));
	start_ = offset;
	std::size_t done = 0;
	while (done < window_.size())
	{
		const ssize_t got =
		    pread(descriptor_, window_.data() + done, window_.size() - done, static_cast<off_t>(offset + done));
		if (got < 0 && errno == EINTR) continue;
		if (got <= 0 && done >= size) break;  // what is read ahead is missed only when somebody asks for it
		if (got <= 0)
		{
			const std::string reason = got < 0 ? std::strerror(errno) : "it has become shorter";
			window_.clear();
			throw_unread(reason);
		}
		done += static_cast<std::size_t>(got);
	}
	window_.resize(done);
}

std::string first_bytes(const std::string& path)
try
{
	constexpr std::uint64_t kSize = 16;
	ByteFile file(path);
	const Bytes bytes = file.view(0, std::min(file.size(), kSize));
	return {reinterpret_cast<const char*>(bytes.data), bytes.size};
}
catch (const Unreadable& e)
{
	throw LogError(path, e.what());
}
}  // namespace d2s1r::logs
