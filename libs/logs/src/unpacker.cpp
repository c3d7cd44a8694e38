// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "unpacker.h"

#include <zlib.h>
#ifdef D2S1R_BZ2
#include <bzlib.h>
#endif
#ifdef D2S1R_LZ4
#include <lz4frame.h>
#endif
#ifdef D2S1R_ZSTD
#include <zstd.h>
#include <zstd_errors.h>
#endif

#include <algorithm>
#include <limits>
#include <new>
#include <stdexcept>

#include "logs/errors.h"

namespace d2s1r::logs
{
namespace
{
[[noreturn]] void throw_damaged(const std::string& method)
{
	throw std::runtime_error("a part that was packed by " + method + " is damaged");
}

/// Takes what was used off the bytes.
void use_all_but(std::size_t left, Bytes& from)
{
	from = {from.data + (from.size - left), left};
}

/// Returns a number of bytes as the libraries count them.
unsigned counted(std::size_t bytes)
{
	return static_cast<unsigned>(std::min<std::size_t>(bytes, std::numeric_limits<unsigned>::max()));
}

class Gzip : public Unpacker
{
   public:
	Gzip()
	{
		constexpr int kGzip = 16 + MAX_WBITS;
		if (inflateInit2(&stream_, kGzip) != Z_OK) throw std::bad_alloc();
	}
	~Gzip() override { inflateEnd(&stream_); }

	std::size_t unpack(Bytes& from, std::uint8_t* to, std::size_t count) override
	{
		stream_.next_out = to;
		stream_.avail_out = counted(count);
		const unsigned room = stream_.avail_out, given = counted(from.size);
		stream_.next_in = const_cast<Bytef*>(from.data);  // it is only read
		stream_.avail_in = given;
		const int state = inflate(&stream_, Z_SYNC_FLUSH);
		use_all_but(from.size - given + stream_.avail_in, from);
		if (state == Z_MEM_ERROR) throw std::bad_alloc();
		if (state != Z_OK && state != Z_STREAM_END) throw_damaged("gzip");
		if (state == Z_STREAM_END) inflateReset(&stream_);  // another part may come after it
		is_within_part_ = state != Z_STREAM_END;
		return room - stream_.avail_out;
	}

   private:
	z_stream stream_ = {};
};

#ifdef D2S1R_BZ2
class Bzip2 : public Unpacker
{
   public:
	Bzip2() { begin(); }
	~Bzip2() override { BZ2_bzDecompressEnd(&stream_); }

	std::size_t unpack(Bytes& from, std::uint8_t* to, std::size_t count) override
	{
		stream_.next_out = reinterpret_cast<char*>(to);
		stream_.avail_out = counted(count);
		const unsigned room = stream_.avail_out, given = counted(from.size);
		stream_.next_in = const_cast<char*>(reinterpret_cast<const char*>(from.data));  // it is only read
		stream_.avail_in = given;
		const int state = BZ2_bzDecompress(&stream_);
		use_all_but(from.size - given + stream_.avail_in, from);
		const unsigned got = room - stream_.avail_out;
		if (state == BZ_MEM_ERROR) throw std::bad_alloc();
		if (state != BZ_OK && state != BZ_STREAM_END) throw_damaged("bz2");
		is_within_part_ = state != BZ_STREAM_END;
		may_hold_more_ = is_within_part_ && got == room;
		if (is_within_part_) return got;
		BZ2_bzDecompressEnd(&stream_);
		begin();  // another part may come after it
		return got;
	}

   private:
	void begin()
	{
		stream_ = {};
		if (BZ2_bzDecompressInit(&stream_, 0, 0) != BZ_OK) throw std::bad_alloc();
	}

	bz_stream stream_ = {};
};
#endif

#ifdef D2S1R_LZ4
class Lz4 : public Unpacker
{
   public:
	Lz4()
	{
		if (LZ4F_isError(LZ4F_createDecompressionContext(&context_, LZ4F_VERSION))) throw std::bad_alloc();
	}
	~Lz4() override { LZ4F_freeDecompressionContext(context_); }

	std::size_t unpack(Bytes& from, std::uint8_t* to, std::size_t count) override
	{
		std::size_t used = from.size, got = count;
		const std::size_t state = LZ4F_decompress(context_, to, &got, from.data, &used, nullptr);
		if (LZ4F_isError(state) && std::strstr(LZ4F_getErrorName(state), "allocation")) throw std::bad_alloc();
		if (LZ4F_isError(state)) throw_damaged("lz4");
		use_all_but(from.size - used, from);
		is_within_part_ = state != 0;
		may_hold_more_ = is_within_part_ && got == count;
		return got;
	}

   private:
	LZ4F_dctx* context_ = nullptr;
};
#endif

#ifdef D2S1R_ZSTD
class Zstd : public Unpacker
{
   public:
	Zstd() : context_(ZSTD_createDCtx(), ZSTD_freeDCtx)
	{
		if (!context_) throw std::bad_alloc();
	}

	std::size_t unpack(Bytes& from, std::uint8_t* to, std::size_t count) override
	{
		ZSTD_inBuffer in{from.data, from.size, 0};
		ZSTD_outBuffer out{to, count, 0};
		const std::size_t state = ZSTD_decompressStream(context_.get(), &out, &in);
		if (ZSTD_getErrorCode(state) == ZSTD_error_memory_allocation) throw std::bad_alloc();
		if (ZSTD_isError(state)) throw_damaged("zstd");
		use_all_but(from.size - in.pos, from);
		is_within_part_ = state != 0;
		may_hold_more_ = is_within_part_ && out.pos == out.size;
		return out.pos;
	}

   private:
	std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context_;
};
#endif
}  // namespace

void throw_too_large(const std::string& what, std::uint64_t size)
{
	throw Unreadable(
	    "has a " + what + " of " + std::to_string(size >> 20) + " MB, more than the " +
	    std::to_string(kMostBytesAtOnce >> 20) + " MB that are read at once; write the log in smaller chunks");
}

std::string method_of(Bytes start)
{
	const std::string bytes(reinterpret_cast<const char*>(start.data), start.size);
	for (const auto& [magic, method] :
	     {std::pair("\x1f\x8b", "gzip"), std::pair("BZh", "bz2"), std::pair("\x28\xb5\x2f\xfd", "zstd")})
		if (bytes.rfind(magic, 0) == 0) return method;
	return "";
}

std::unique_ptr<Unpacker> make_unpacker(const std::string& method)
{
	if (method == "gzip") return std::make_unique<Gzip>();
#ifdef D2S1R_BZ2
	if (method == "bz2") return std::make_unique<Bzip2>();
#endif
#ifdef D2S1R_LZ4
	if (method == "lz4") return std::make_unique<Lz4>();
#endif
#ifdef D2S1R_ZSTD
	if (method == "zstd") return std::make_unique<Zstd>();
#endif
	for (const std::string known : {"bz2", "lz4", "zstd"})
		if (method == known)
			throw Unreadable(
			    "is packed by " + method + ", which this program was built without; install lib" + method +
			    "-dev and build it again");
	throw Unreadable(
	    "is packed by '" + method.substr(0, 20) + "', which is not known; pack it by bz2, lz4 or zstd, or not at all");
}

std::vector<std::uint8_t> unpack(
    const std::string& method, Bytes packed, std::optional<std::uint64_t> size,
    const std::function<void()>& ask_to_stop)
{
	constexpr std::size_t kMostAtOnce = 1 << 20;  // [byte] which take up to a tenth of a second
	const std::size_t at_once = std::min(kMostAtOnce, 1000 + 8 * packed.size);
	if (size.value_or(0) > kMostBytesAtOnce) throw_too_large("chunk", *size);
	if (method.empty() || method == "none")
	{
		if (packed.size != size) throw std::runtime_error("a chunk has another size than it says");
		return {packed.data, packed.data + packed.size};
	}
	const auto unpacker = make_unpacker(method);
	std::vector<std::uint8_t> unpacked;
	unpacked.reserve(static_cast<std::size_t>(size.value_or(0)) + at_once);
	do
	{
		ask_to_stop();
		const std::size_t before = packed.size, done = unpacked.size();
		unpacked.resize(done + at_once);
		const std::size_t got = unpacker->unpack(packed, unpacked.data() + done, at_once);
		unpacked.resize(done + got);
		if (got == 0 && packed.size == before) throw_damaged(method);  // it is cut short
		if (size && unpacked.size() > *size) throw_damaged(method);
		if (unpacked.size() > kMostBytesAtOnce) throw_too_large("message", unpacked.size());
	} while (unpacker->is_within_part() || (unpacked.size() < size.value_or(0) && packed.size > 0));
	if (size && unpacked.size() != *size) throw_damaged(method);
	return unpacked;
}
}  // namespace d2s1r::logs
