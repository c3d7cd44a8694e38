// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "unpacking_stream.h"

#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>
#ifdef D2S1R_ZSTD
#include <zstd.h>
#include <zstd_errors.h>
#endif

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <thread>

#include "bags/byte_file.h"

namespace d2s1r::logs
{
namespace
{
constexpr std::size_t kBytesOfMagic = 4;  // [byte] by which a file is known to be packed, at most

/// Bytes that are still to be used.
struct Input
{
	std::uint8_t* begin;
	std::uint8_t* end;
};

/// One way to pack a file, in parts that follow each other.
class Packing
{
   public:
	Packing() = default;
	Packing(const Packing&) = delete;
	Packing& operator=(const Packing&) = delete;
	virtual ~Packing() = default;

	/// Returns the first byte of each part.
	virtual std::uint8_t start() const = 0;
	/// Unpacks up to `count` bytes of a part. Returns how many.
	/// \throws std::runtime_error if the part is damaged, std::bad_alloc
	virtual std::size_t unpack(Input& from, std::uint8_t* to, std::size_t count) = 0;

	bool is_within_part() const { return is_within_part_; }  //!< a part has begun and not ended
	bool may_hold_more() const { return may_hold_more_; }    //!< of what it has been given, for want of room

   protected:
	[[noreturn]] static void refuse() { throw std::runtime_error("packed data is damaged"); }

	bool is_within_part_ = false, may_hold_more_ = false;
};

class Gzip : public Packing
{
   public:
	Gzip()
	{
		constexpr int kGzip = 16 + MAX_WBITS;
		if (inflateInit2(&zip_, kGzip) != Z_OK) throw std::bad_alloc();
	}
	~Gzip() override { inflateEnd(&zip_); }

	std::uint8_t start() const override { return 0x1f; }

	std::size_t unpack(Input& from, std::uint8_t* to, std::size_t count) override
	{
		zip_.next_out = to;
		zip_.avail_out = static_cast<uInt>(std::min<std::size_t>(count, std::numeric_limits<uInt>::max()));
		const uInt room = zip_.avail_out;
		zip_.next_in = from.begin;
		zip_.avail_in = static_cast<uInt>(from.end - from.begin);
		const int state = inflate(&zip_, Z_SYNC_FLUSH);
		from.begin = from.end - zip_.avail_in;
		if (state == Z_MEM_ERROR) throw std::bad_alloc();
		if (state != Z_OK && state != Z_STREAM_END) refuse();
		if (state == Z_STREAM_END) inflateReset(&zip_);  // another part may come after it
		is_within_part_ = state != Z_STREAM_END;
		return room - zip_.avail_out;
	}

   private:
	z_stream zip_ = {};
};

#ifdef D2S1R_ZSTD
class Zstd : public Packing
{
   public:
	Zstd() : context_(ZSTD_createDCtx(), ZSTD_freeDCtx)
	{
		if (!context_) throw std::bad_alloc();
	}

	std::uint8_t start() const override { return 0x28; }

	std::size_t unpack(Input& from, std::uint8_t* to, std::size_t count) override
	{
		ZSTD_inBuffer in{from.begin, static_cast<std::size_t>(from.end - from.begin), 0};
		ZSTD_outBuffer out{to, count, 0};
		const std::size_t state = ZSTD_decompressStream(context_.get(), &out, &in);
		from.begin += in.pos;
		if (ZSTD_getErrorCode(state) == ZSTD_error_memory_allocation) throw std::bad_alloc();
		if (ZSTD_isError(state)) refuse();
		is_within_part_ = state != 0;
		may_hold_more_ = is_within_part_ && out.pos == out.size;
		return out.pos;
	}

   private:
	std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context_;
};
#endif

/// Returns how a file is packed that starts like this; null if it is not.
std::unique_ptr<Packing> packing_of(const Input& start)
{
	const Bytes bytes{start.begin, static_cast<std::size_t>(start.end - start.begin)};
	if (bytes.size > 1 && bytes.data[0] == 0x1f && bytes.data[1] == 0x8b) return std::make_unique<Gzip>();
#ifdef D2S1R_ZSTD
	if (is_zstd_frame(bytes)) return std::make_unique<Zstd>();
#endif
	return nullptr;
}

class UnpackingStream : public InputStream
{
   public:
	UnpackingStream(int descriptor, bool follows) : descriptor_(descriptor), follows_(follows) {}
	~UnpackingStream() override { close(descriptor_); }

	std::size_t read(void* buffer, std::size_t count) override
	{
		if (!has_started_) start();
		auto* const to = static_cast<std::uint8_t*>(buffer);
		std::size_t got = 0;
		while (got < count)
		{
			const std::size_t more = packing_ ? unpack(to + got, count - got) : take(to + got, count - got);
			if (more == 0) break;
			got += more;
		}
		if (got == 0 && count > 0 && packing_ && packing_->is_within_part()) throw CutShort();
		return got;
	}

   private:
	/// Finds out how the stream is packed.
	void start()
	{
		has_started_ = true;
		while (end_ <= kBytesOfMagic && fill())
			;
		packing_ = packing_of({block_.data(), block_.data() + end_});
	}

	/// Waits for bytes and puts them behind those in the block. Returns whether any came.
	bool fill()
	{
		if (begin_ == end_) begin_ = end_ = 0;
		for (;;)
		{
			const ssize_t got = ::read(descriptor_, block_.data() + end_, block_.size() - end_);
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
		std::size_t got = 0;
		while (got == 0)
		{
			if (begin_ == end_ && !packing_->may_hold_more() && !fill()) return 0;
			// gzip, too, ignores what else is behind the last part
			if (!packing_->is_within_part() && block_[begin_] != packing_->start()) return 0;
			Input input = {block_.data() + begin_, block_.data() + end_};
			got = packing_->unpack(input, to, count);
			begin_ = static_cast<std::size_t>(input.begin - block_.data());
		}
		return got;
	}

	int descriptor_;
	bool follows_;
	bool has_started_ = false;
	std::unique_ptr<Packing> packing_;  //!< null: not packed
	std::array<std::uint8_t, 1 << 16> block_{};
	std::size_t begin_ = 0, end_ = 0;  //!< [byte] of what is still to be used in the block
};
}  // namespace

std::unique_ptr<InputStream> unpack(int descriptor, bool follows)
{
	return std::make_unique<UnpackingStream>(descriptor, follows);
}
}  // namespace d2s1r::logs
