// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "bags/byte_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "logs/errors.h"
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
#include <cerrno>
#include <memory>
#include <new>

namespace d2s1r::logs
{
namespace
{
constexpr std::uint64_t kReadAhead = 1 << 18;  // [byte]

[[noreturn]] void throw_damaged(const std::string& method)
{
	throw std::runtime_error("a part that was packed by " + method + " is damaged");
}

[[noreturn]] void throw_too_large(const std::string& what, std::uint64_t size)
{
	throw Unreadable(
	    "has a " + what + " of " + std::to_string(size >> 20) + " MB, more than the " +
	    std::to_string(kMostBytesAtOnce >> 20) + " MB that are read at once; write the log in smaller chunks");
}

#if !defined(D2S1R_BZ2) || !defined(D2S1R_LZ4) || !defined(D2S1R_ZSTD)
[[noreturn]] void throw_missing(const std::string& method, const std::string& package)
{
	throw Unreadable(
	    "is packed by " + method + ", which this program was built without; install " + package +
	    " and build it again");
}
#endif

#ifdef D2S1R_BZ2
/// Ends the unpacking of bz2, whatever happens.
struct Bz2Stream : bz_stream
{
	Bz2Stream() : bz_stream()
	{
		if (BZ2_bzDecompressInit(this, 0, 0) != BZ_OK) throw std::bad_alloc();
	}
	~Bz2Stream() { BZ2_bzDecompressEnd(this); }
	Bz2Stream(const Bz2Stream&) = delete;
	Bz2Stream& operator=(const Bz2Stream&) = delete;
};
#endif

/// \param ask_to_stop is called for each megabyte, which takes up to a tenth of a second
void unpack_bz2(Bytes packed, std::vector<std::uint8_t>& into, const std::function<void()>& ask_to_stop)
{
#ifdef D2S1R_BZ2
	constexpr std::size_t kAtOnce = 1 << 20;  // [byte]
	Bz2Stream stream;
	stream.next_in = const_cast<char*>(reinterpret_cast<const char*>(packed.data));  // it is only read
	stream.avail_in = static_cast<unsigned>(packed.size);
	std::size_t written = 0;
	for (int result = BZ_OK; result != BZ_STREAM_END;)
	{
		ask_to_stop();
		const std::size_t room = std::min(kAtOnce, into.size() - written);
		stream.next_out = reinterpret_cast<char*>(into.data()) + written;
		stream.avail_out = static_cast<unsigned>(room);
		result = BZ2_bzDecompress(&stream);
		const std::size_t got = room - stream.avail_out;
		written += got;
		if (result == BZ_MEM_ERROR) throw std::bad_alloc();
		const bool is_stuck = got == 0 && result == BZ_OK;  // the bytes are cut short, or more than were announced
		if ((result != BZ_OK && result != BZ_STREAM_END) || is_stuck) throw_damaged("bz2");
	}
	if (written != into.size()) throw_damaged("bz2");
#else
	(void)packed, (void)into, (void)ask_to_stop;
	throw_missing("bz2", "libbz2-dev");
#endif
}

void unpack_lz4(Bytes packed, std::vector<std::uint8_t>& into)
{
#ifdef D2S1R_LZ4
	LZ4F_dctx* context = nullptr;
	if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) throw std::bad_alloc();
	std::size_t read = 0, written = 0, hint = 1;
	while (hint != 0 && !LZ4F_isError(hint))
	{
		std::size_t source_size = packed.size - read, target_size = into.size() - written;
		hint = LZ4F_decompress(context, into.data() + written, &target_size, packed.data + read, &source_size, nullptr);
		if (source_size == 0 && target_size == 0) break;
		read += source_size;
		written += target_size;
	}
	LZ4F_freeDecompressionContext(context);
	if (LZ4F_isError(hint) && std::strstr(LZ4F_getErrorName(hint), "allocation")) throw std::bad_alloc();
	if (hint != 0 || written != into.size()) throw_damaged("lz4");
#else
	(void)packed, (void)into;
	throw_missing("lz4", "liblz4-dev");
#endif
}

void unpack_zstd(Bytes packed, std::vector<std::uint8_t>& into)
{
#ifdef D2S1R_ZSTD
	const std::size_t result = ZSTD_decompress(into.data(), into.size(), packed.data, packed.size);
	if (ZSTD_getErrorCode(result) == ZSTD_error_memory_allocation) throw std::bad_alloc();
	if (result != into.size()) throw_damaged("zstd");
#else
	(void)packed, (void)into;
	throw_missing("zstd", "libzstd-dev");
#endif
}

#ifdef D2S1R_ZSTD
/// Unpacks piece by piece what does not tell its size. \throws Unreadable if it is larger than kMostBytesAtOnce
std::vector<std::uint8_t> unpack_zstd_of_unknown_size(Bytes packed)
{
	constexpr int kLargestWindow = 26;  // [bit] of what zstd keeps for itself, which is no more than kMostBytesAtOnce
	static_assert(std::uint64_t{1} << kLargestWindow <= kMostBytesAtOnce);
	const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), ZSTD_freeDCtx);
	if (!context) throw std::bad_alloc();
	ZSTD_DCtx_setParameter(context.get(), ZSTD_d_windowLogMax, kLargestWindow);
	std::vector<std::uint8_t> unpacked;
	ZSTD_inBuffer in{packed.data, packed.size, 0};
	for (std::size_t left = 1; left != 0;)
	{
		const std::size_t done = unpacked.size();
		unpacked.resize(done + ZSTD_DStreamOutSize());
		ZSTD_outBuffer out{unpacked.data() + done, unpacked.size() - done, 0};
		const std::size_t read = in.pos;
		left = ZSTD_decompressStream(context.get(), &out, &in);
		if (ZSTD_getErrorCode(left) == ZSTD_error_memory_allocation) throw std::bad_alloc();
		const bool is_cut = left != 0 && out.pos == 0 && in.pos == read;
		if (ZSTD_isError(left) || is_cut) throw_damaged("zstd");
		unpacked.resize(done + out.pos);
		if (unpacked.size() > kMostBytesAtOnce) throw_too_large("message", unpacked.size());
	}
	return unpacked;
}
#endif
}  // namespace

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

std::vector<std::uint8_t> unpack(
    const std::string& method, Bytes packed, std::uint64_t size, const std::function<void()>& ask_to_stop)
{
	if (size > kMostBytesAtOnce) throw_too_large("chunk", size);
	std::vector<std::uint8_t> unpacked(static_cast<std::size_t>(size));
	if (method.empty() || method == "none")
	{
		if (packed.size != size) throw std::runtime_error("a chunk has another size than it says");
		std::copy_n(packed.data, packed.size, unpacked.data());
	}
	else if (method == "bz2")
		unpack_bz2(packed, unpacked, ask_to_stop);
	else if (method == "lz4")
		unpack_lz4(packed, unpacked);
	else if (method == "zstd")
		unpack_zstd(packed, unpacked);
	else
		throw Unreadable(
		    "is packed by '" + method.substr(0, 20) +
		    "', which is not known; pack it by bz2, lz4 or zstd, or not at all");
	return unpacked;
}

std::vector<std::uint8_t> unpack_zstd_frame(Bytes packed)
{
#ifdef D2S1R_ZSTD
	const unsigned long long size = ZSTD_getFrameContentSize(packed.data, packed.size);
	if (size == ZSTD_CONTENTSIZE_ERROR) throw_damaged("zstd");
	return size == ZSTD_CONTENTSIZE_UNKNOWN ? unpack_zstd_of_unknown_size(packed) : unpack("zstd", packed, size);
#else
	(void)packed;
	throw_missing("zstd", "libzstd-dev");
#endif
}

bool is_zstd_frame(Bytes bytes)
{
	constexpr std::uint8_t kMagic[] = {0x28, 0xb5, 0x2f, 0xfd};
	return bytes.size > sizeof kMagic && std::memcmp(bytes.data, kMagic, sizeof kMagic) == 0;
}
}  // namespace d2s1r::logs
