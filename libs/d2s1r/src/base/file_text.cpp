// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/file_text.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace d2s1r
{
namespace
{
[[noreturn]] void refuse(int error)
{
	const bool is_out_of_descriptors = error == EMFILE || error == ENFILE;
	throw std::runtime_error(
	    std::string("cannot be read (") + std::strerror(error) + "); " +
	    (is_out_of_descriptors ? "allow the program more open files (ulimit -n)"
	                           : "check that it exists, is a file and is readable"));
}
}  // namespace

std::string read_text(const std::string& file, std::size_t most)
{
	const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"), std::fclose);
	if (!stream) refuse(errno);
	std::string text;
	std::array<char, 1 << 16> block;
	for (std::size_t got = 1; got > 0 && text.size() < most; text.append(block.data(), got))
	{
		errno = 0;
		got = std::fread(block.data(), 1, std::min(block.size(), most - text.size()), stream.get());
		if (std::ferror(stream.get())) refuse(errno);
	}
	return text;
}
}  // namespace d2s1r
