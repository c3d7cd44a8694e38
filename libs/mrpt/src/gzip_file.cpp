// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/gzip_file.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/serialization/CArchive.h>

#include <array>
#include <fstream>
#include <new>

namespace d2s1r
{
namespace
{
template <std::size_t N>
std::array<unsigned char, N> last_bytes(const std::string& path)
{
	std::array<unsigned char, N> bytes{};
	std::ifstream in(path, std::ios::binary);
	in.seekg(-static_cast<std::streamoff>(N), std::ios::end);
	in.read(reinterpret_cast<char*>(bytes.data()), N);
	return in ? bytes : std::array<unsigned char, N>{};
}
}  // namespace

bool is_whole_gzip(const std::string& path)
{
	mrpt::io::CFileGZInputStream stream;
	if (!stream.open(path)) return false;
	std::vector<std::uint8_t> block(1 << 16);
	std::uint32_t size = 0;  // modulo 2^32, as in the file
	for (std::size_t got = block.size(); got > 0 && got <= block.size(); size += static_cast<std::uint32_t>(got))
		got = stream.Read(block.data(), block.size());
	const auto end = last_bytes<4>(path);
	return size > 0 && size == (end[0] | end[1] * 0x100U | end[2] * 0x10000U | end[3] * 0x1000000U);
}

GzipFile::GzipFile(const std::string& path) : pending_(path)
{
	if (!stream_.open(pending_.temporary())) pending_.fail();
}

void GzipFile::write(const std::vector<std::uint8_t>& bytes)
{
	empty_ = empty_ && bytes.empty();
	if (stream_.Write(bytes.data(), bytes.size()) != bytes.size()) pending_.fail();
}

void GzipFile::write(const mrpt::serialization::CSerializable& object)
{
	empty_ = false;
	try
	{
		mrpt::serialization::archiveFrom<mrpt::io::CStream>(stream_) << object;
	}
	catch (const std::exception& e)
	{
		if (is_out_of_memory(e)) throw std::bad_alloc();
		pending_.fail();
	}
}

void GzipFile::finish()
{
	stream_.close();
	finished_ = true;
	if (!empty_ && !is_whole_gzip(pending_.temporary())) pending_.fail();
}

void GzipFile::commit()
{
	if (!finished_) finish();
	pending_.commit();
}
}  // namespace d2s1r
