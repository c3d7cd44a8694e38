// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/index_file.h"

#include <d2s1r/unusable_index.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace d2s1r
{
namespace
{
constexpr std::array<char, 16> kMagic = {"d2s1r index\r\n\x1a\n"};  // as in PNG: shows files that were copied as text
constexpr std::uint32_t kByteOrder = 0x01020304;
constexpr std::uint32_t kVersion = 7;  //!< of the file's layout

struct Header
{
	std::array<char, 16> magic = kMagic;
	std::uint32_t byte_order = kByteOrder;
	std::uint32_t version = kVersion;
	IndexKey key;
	std::uint64_t bytes = 0;    //!< [byte] of the whole file
	std::uint64_t content = 0;  //!< fingerprint of all that follows
	std::uint64_t header = 0;   //!< fingerprint of the header up to here
};
static_assert(sizeof(Header) == kIndexAlignment);

/// What comes before each array.
struct Prefix
{
	std::uint64_t size = 0;   //!< [byte] of a value
	std::uint64_t count = 0;  //!< [-] of values
};

std::uint64_t sum_of(const Header& header)
{
	return fingerprint_of(&header, offsetof(Header, header));
}

std::size_t aligned(std::size_t bytes)
{
	return (bytes + kIndexAlignment - 1) / kIndexAlignment * kIndexAlignment;
}

constexpr const char* kBuildAgain = "build the index again";
constexpr const char* kNameAnother = "name another file";

/// Checks that a header, which may be any bytes, is that of an index of `key`.
void check_header(const std::string& file, const Header& header, const IndexKey& key, std::size_t file_size)
{
	if (header.magic != kMagic) throw UnusableIndex(file, "is not the file of an index", kNameAnother);
	const auto build_again = [&](const char* why) { throw UnusableIndex(file, why, kBuildAgain); };
	if (header.byte_order == __builtin_bswap32(kByteOrder)) build_again("was saved by a machine of another byte order");
	if (header.byte_order == kByteOrder && header.version != kVersion)
		build_again("was saved by another version of the library");
	if (header.header != sum_of(header) || header.bytes != file_size) build_again("is damaged");
	if (header.key.map != key.map) build_again("is the index of another map");
	if (header.key.parameters != key.parameters)
		build_again("is the index of other parameters or of another version of the library");
}

/// Returns whether there is a folder, a device or a pipe, or a file that cannot be read, or is not empty and does not
/// begin as an index does.
bool is_something_else(const std::string& file)
{
	struct stat status = {};
	if (stat(file.c_str(), &status) != 0) return false;
	if (!S_ISREG(status.st_mode)) return true;
	const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"), std::fclose);
	std::array<char, kMagic.size()> start{};
	if (!stream) return true;
	const std::size_t got = std::fread(start.data(), 1, start.size(), stream.get());
	return got > 0 && std::memcmp(start.data(), kMagic.data(), got) != 0;
}

const std::string& refuse_something_else(const std::string& file)
{
	if (is_something_else(file))
		throw UnusableIndex(file, "exists and is not the file of an index that can be read", kNameAnother);
	return file;
}

std::shared_ptr<const unsigned char> map_into_memory(const std::string& file, std::size_t& size)
{
	const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // waits for no pipe
	if (descriptor < 0) throw UnusableIndex(file, std::string("cannot be read (") + std::strerror(errno) + ")", "");
	struct stat status = {};
	const bool is_file = fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
	size = is_file ? static_cast<std::size_t>(status.st_size) : 0;
	void* const memory = size > 0 ? mmap(nullptr, size, PROT_READ, MAP_SHARED | MAP_POPULATE, descriptor, 0) : nullptr;
	close(descriptor);
	if (size == 0) throw UnusableIndex(file, "is not the file of an index", kNameAnother);
	if (memory == MAP_FAILED)
		throw UnusableIndex(file, std::string("cannot be mapped into memory (") + std::strerror(errno) + ")", "");
	const auto unmap = [size](const unsigned char* mapped) { munmap(const_cast<unsigned char*>(mapped), size); };
	return {static_cast<const unsigned char*>(memory), unmap};
}
}  // namespace

std::uint64_t fingerprint_of(const void* bytes, std::size_t count, std::uint64_t seed)
{
	return XXH3_64bits_withSeed(bytes, count, seed);
}

IndexWriter::IndexWriter(const std::string& file)
    : pending_(refuse_something_else(file)),
      stream_(std::fopen(pending_.temporary().c_str(), "wbe"), std::fclose),
      sum_(XXH3_createState(), [](XXH3_state_t* sum) { XXH3_freeState(sum); })
{
	if (!stream_) pending_.fail();
	if (!sum_) throw std::bad_alloc();
	XXH3_64bits_reset(sum_.get());
	const Header unfinished{};
	if (std::fwrite(&unfinished, sizeof unfinished, 1, stream_.get()) != 1) pending_.fail();
	written_ = sizeof unfinished;
}

void IndexWriter::put(const void* bytes, std::size_t count)
{
	if (count == 0) return;
	if (std::fwrite(bytes, 1, count, stream_.get()) != count) pending_.fail();
	XXH3_64bits_update(sum_.get(), bytes, count);
	written_ += count;
}

void IndexWriter::write(const void* values, std::size_t size, std::size_t count)
{
	constexpr std::array<char, kIndexAlignment> kZeros{};
	const Prefix prefix{size, count};
	put(&prefix, sizeof prefix);
	put(kZeros.data(), aligned(written_) - written_);
	put(values, size * count);
	put(kZeros.data(), aligned(written_) - written_);
}

void IndexWriter::commit(const IndexKey& key)
{
	Header header;
	header.key = key;
	header.bytes = written_;
	header.content = XXH3_64bits_digest(sum_.get());
	header.header = sum_of(header);
	if (std::fseek(stream_.get(), 0, SEEK_SET) != 0) pending_.fail();
	if (std::fwrite(&header, sizeof header, 1, stream_.get()) != 1) pending_.fail();
	if (std::fclose(stream_.release()) != 0) pending_.fail();
	pending_.commit();
}

IndexReader::IndexReader(const std::string& file, const IndexKey& key) : file_(file)
{
	memory_ = map_into_memory(file, size_);
	Header header{};
	std::memcpy(&header, memory_.get(), std::min(sizeof header, size_));
	check_header(file, header, key, size_);
	at_ = sizeof header;
	if (header.content != fingerprint_of(memory_.get() + at_, size_ - at_))
		throw UnusableIndex(file, "is damaged", kBuildAgain);
}

void IndexReader::refuse_content() const
{
	throw UnusableIndex(file_, "does not hold what an index holds", kBuildAgain);
}

std::pair<const void*, std::size_t> IndexReader::read(std::size_t size, std::size_t expected_count)
{
	Prefix prefix;
	const auto is_inside = [this](std::size_t bytes) { return at_ <= size_ && bytes <= size_ - at_; };
	if (!is_inside(sizeof prefix)) refuse_content();
	std::memcpy(&prefix, memory_.get() + at_, sizeof prefix);
	at_ = aligned(at_ + sizeof prefix);
	const bool is_expected = prefix.size == size && (expected_count == 0 || prefix.count == expected_count);
	if (!is_expected || prefix.count > size_ / size || !is_inside(size * prefix.count)) refuse_content();
	const void* const values = memory_.get() + at_;
	at_ = aligned(at_ + size * prefix.count);
	return {values, prefix.count};
}
}  // namespace d2s1r
