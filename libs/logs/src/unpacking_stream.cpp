// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "unpacking_stream.h"

#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <new>
#include <thread>

namespace d2s1r::logs
{
namespace
{
class UnpackingStream : public InputStream
{
   public:
	UnpackingStream(int descriptor, bool follows) : descriptor_(descriptor), follows_(follows) {}
	~UnpackingStream() override
	{
		if (is_packed_) inflateEnd(&zip_);
		close(descriptor_);
	}

	std::size_t Read(void* buffer, std::size_t count) override
	{
		if (!has_started_) start();
		auto* const to = static_cast<std::uint8_t*>(buffer);
		std::size_t got = 0;
		while (got < count)
		{
			const std::size_t more = is_packed_ ? unpack(to + got, count - got) : take(to + got, count - got);
			if (more == 0) break;
			got += more;
		}
		if (got == 0 && count > 0 && is_within_part_) throw CutShort();
		return got;
	}

   private:
	/// Finds out whether the stream is packed.
	void start()
	{
		has_started_ = true;
		while (end_ < 2 && fill())
			;
		is_packed_ = end_ >= 2 && block_[0] == 0x1f && block_[1] == 0x8b;
		constexpr int kGzip = 16 + MAX_WBITS;
		if (is_packed_ && inflateInit2(&zip_, kGzip) != Z_OK) throw std::bad_alloc();
	}

	/// Waits for bytes and puts them behind those in the block. Returns whether any came.
	bool fill()
	{
		if (begin_ == end_) begin_ = end_ = 0;
		for (;;)
		{
			const ssize_t got = read(descriptor_, block_.data() + end_, block_.size() - end_);
			if (got < 0 && errno == EINTR) continue;
			if (got < 0) throw ReadError(std::strerror(errno));
			if (got > 0) end_ += static_cast<std::size_t>(got);
			if (got != 0 || !waits()) return got > 0;
		}
	}

	/// Waits for a file to grow. Returns whether it may have. \throws BecameShorter
	bool waits() const
	{
		constexpr std::chrono::milliseconds kPause(2);
		struct stat file = {};
		if (!follows_ || fstat(descriptor_, &file) != 0 || file.st_nlink == 0) return false;
		if (file.st_size < lseek(descriptor_, 0, SEEK_CUR)) throw BecameShorter();
		std::this_thread::sleep_for(kPause);
		return true;
	}

	std::size_t take(std::uint8_t* to, std::size_t count)
	{
		if (begin_ == end_ && !fill()) return 0;
		const std::size_t taken = std::min(count, end_ - begin_);
		std::memcpy(to, block_.data() + begin_, taken);
		begin_ += taken;
		return taken;
	}

	std::size_t unpack(std::uint8_t* to, std::size_t count)
	{
		zip_.next_out = to;
		zip_.avail_out = static_cast<uInt>(std::min<std::size_t>(count, std::numeric_limits<uInt>::max()));
		const uInt room = zip_.avail_out;
		while (zip_.avail_out == room)
		{
			if (begin_ == end_ && !fill()) return 0;
			constexpr std::uint8_t kStart = 0x1f;  // of a part; gzip, too, ignores what else is behind the last one
			if (!is_within_part_ && block_[begin_] != kStart) return 0;
			zip_.next_in = block_.data() + begin_;
			zip_.avail_in = static_cast<uInt>(end_ - begin_);
			const int state = inflate(&zip_, Z_SYNC_FLUSH);
			begin_ = end_ - zip_.avail_in;
			if (state == Z_MEM_ERROR) throw std::bad_alloc();
			if (state == Z_STREAM_END)
				inflateReset(&zip_);  // another part may come after it
			else if (state != Z_OK)
				throw std::runtime_error("packed data is damaged");
			is_within_part_ = state != Z_STREAM_END;
		}
		return room - zip_.avail_out;
	}

	int descriptor_;
	bool follows_;
	bool has_started_ = false, is_packed_ = false;
	bool is_within_part_ = false;  //!< [-] a part that gzip packed has begun and not ended
	std::array<std::uint8_t, 1 << 16> block_{};
	std::size_t begin_ = 0, end_ = 0;  //!< [byte] of what is still to be used in the block
	z_stream zip_ = {};
};
}  // namespace

std::unique_ptr<InputStream> unpack(int descriptor, bool follows)
{
	return std::make_unique<UnpackingStream>(descriptor, follows);
}
}  // namespace d2s1r::logs
