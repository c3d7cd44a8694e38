// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/file_text.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
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

void check_readable(const std::string& file)
{
	namespace fs = std::filesystem;
	std::error_code error;
	const auto status = fs::status(file, error);
	if (fs::exists(status) && !fs::is_regular_file(status))
		throw std::runtime_error("cannot be read (it is a folder, a device or a pipe); name the file of a map");
	if (read_text(file, 1).empty()) throw std::runtime_error("is empty; copy or save the map again");
}
}  // namespace d2s1r
