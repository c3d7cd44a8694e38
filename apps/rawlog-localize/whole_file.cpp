// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "whole_file.h"

#include <mrpt/io/CFileGZInputStream.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <vector>

namespace d2s1r::app
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

bool is_whole_png(const std::string& path)
{
	constexpr std::array<unsigned char, 8> kEnd = {'I', 'E', 'N', 'D', 0xae, 0x42, 0x60, 0x82};
	return last_bytes<8>(path) == kEnd;
}
}  // namespace d2s1r::app
