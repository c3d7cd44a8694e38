// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "text_file.h"

#include <fcntl.h>
#include <unistd.h>

#include "logs/errors.h"
#include "unpacking_stream.h"
#ifdef D2S1R_BZ2
#include <bzlib.h>
#endif

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>
#include <stdexcept>
#include <vector>

namespace d2s1r::logs
{
namespace
{
/// Plain, or packed as unpack() knows.
class StreamText : public TextFile
{
   public:
	explicit StreamText(const std::string& path)
	{
		const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
		if (descriptor < 0) throw cannot_open(path);
		stream_ = unpack(descriptor, false);
	}

	std::size_t read(char* buffer, std::size_t size) override { return stream_->read(buffer, size); }

   private:
	std::unique_ptr<InputStream> stream_;
};

#ifdef D2S1R_BZ2
/// Packed by bzip2, in one stream or several.
class Bzip2Text : public TextFile
{
   public:
	explicit Bzip2Text(const std::string& path) : descriptor_(open(path.c_str(), O_RDONLY | O_CLOEXEC))
	{
		if (descriptor_ < 0) throw cannot_open(path);
		BZ2_bzDecompressInit(&stream_, 0, 0);
	}
	~Bzip2Text() override
	{
		BZ2_bzDecompressEnd(&stream_);
		close(descriptor_);
	}
	Bzip2Text(const Bzip2Text&) = delete;
	Bzip2Text& operator=(const Bzip2Text&) = delete;

	std::size_t read(char* buffer, std::size_t size) override
	{
		stream_.next_out = buffer;
		stream_.avail_out = static_cast<unsigned>(size);
		while (stream_.avail_out > 0)
		{
			if (stream_.avail_in == 0)
			{
				stream_.next_in = packed_.data();
				stream_.avail_in = read_packed();
				if (stream_.avail_in == 0 && is_between_streams_) break;
				if (stream_.avail_in == 0) throw std::runtime_error("the part packed by bzip2 is not whole");
			}
			is_between_streams_ = false;
			const int result = BZ2_bzDecompress(&stream_);
			if (result == BZ_MEM_ERROR || !stream_.state) throw std::bad_alloc();
			if (result != BZ_OK && result != BZ_STREAM_END)
				throw std::runtime_error("the part packed by bzip2 is damaged");
			if (result == BZ_STREAM_END) start_next_stream();
		}
		return size - stream_.avail_out;
	}

   private:
	/// Returns how many bytes have been read into packed_, 0 at the end.
	unsigned read_packed()
	{
		for (;;)
		{
			const ssize_t got = ::read(descriptor_, packed_.data(), packed_.size());
			if (got >= 0) return static_cast<unsigned>(got);
			if (errno != EINTR) throw ReadError(std::strerror(errno));
		}
	}

	void start_next_stream()
	{
		const bz_stream before = stream_;
		BZ2_bzDecompressEnd(&stream_);
		stream_ = {};
		BZ2_bzDecompressInit(&stream_, 0, 0);
		stream_.next_in = before.next_in;
		stream_.avail_in = before.avail_in;
		stream_.next_out = before.next_out;
		stream_.avail_out = before.avail_out;
		is_between_streams_ = true;
	}

	int descriptor_;
	bz_stream stream_{};
	std::vector<char> packed_ = std::vector<char>(1 << 16);
	bool is_between_streams_ = false;
};
#endif

bool is_bzip2(const std::string& path)
{
	char magic[3] = {};
	std::FILE* file = std::fopen(path.c_str(), "rb");
	if (!file) return false;
	const std::size_t got = std::fread(magic, 1, sizeof magic, file);
	std::fclose(file);
	return got == sizeof magic && std::equal(magic, magic + 3, "BZh");
}
}  // namespace

std::unique_ptr<TextFile> open_text(const std::string& path)
{
	if (!is_bzip2(path)) return std::make_unique<StreamText>(path);
#ifdef D2S1R_BZ2
	return std::make_unique<Bzip2Text>(path);
#else
	throw LogError(
	    path,
	    "is packed by bzip2, which this program was built without; install libbz2-dev and build it again, or unpack "
	    "it");
#endif
}

std::string read_unpacked_start(const std::string& path, std::size_t size)
{
	std::string start(size, '\0');
	start.resize(open_text(path)->read(start.data(), size));
	return start;
}
}  // namespace d2s1r::logs
