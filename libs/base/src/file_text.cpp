// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/file_text.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "base/errors.h"

namespace d2s1r
{
namespace
{
[[noreturn]] void refuse_reading(int error)
{
	const bool is_out_of_descriptors = error == EMFILE || error == ENFILE;
	const char* const advice = is_out_of_descriptors ? "allow the program more open files (ulimit -n)"
	                           : error == EIO        ? "check the disk or the connection"
	                                                 : "check that it exists, is a file and is readable";
	throw std::runtime_error(std::string("cannot be read (") + std::strerror(error) + "); " + advice);
}

class Descriptor
{
   public:
	explicit Descriptor(int number) : number_(number) {}
	~Descriptor()
	{
		if (number_ >= 0) close(number_);
	}
	Descriptor(const Descriptor&) = delete;
	Descriptor& operator=(const Descriptor&) = delete;

	int number() const { return number_; }

   private:
	int number_;
};
}  // namespace

void read_blocks(const std::string& file, const std::function<bool(const char*, std::size_t)>& take)
{
	const Descriptor descriptor(open(file.c_str(), O_RDONLY | O_CLOEXEC));
	if (descriptor.number() < 0) refuse_reading(errno);
	std::array<char, kFileBlock> block;
	for (;;)
	{
		std::size_t filled = 0;
		while (filled < block.size())
		{
			const ssize_t got = read(descriptor.number(), block.data() + filled, block.size() - filled);
			if (got < 0 && errno == EINTR) continue;
			if (got < 0) refuse_reading(errno);
			if (got == 0) break;
			filled += static_cast<std::size_t>(got);
		}
		if (filled == 0 || !take(block.data(), filled) || filled < block.size()) return;
	}
}

std::string read_text(const std::string& file, std::size_t most)
{
	std::string text;
	read_blocks(
	    file,
	    [&](const char* block, std::size_t count)
	    {
		    text.append(block, std::min(count, most - text.size()));
		    return text.size() < most;
	    });
	return text;
}

void check_readable(const std::string& file)
{
	namespace fs = std::filesystem;
	std::error_code error;
	const auto status = fs::status(file, error);
	if (fs::exists(status) && !fs::is_regular_file(status))
		throw std::runtime_error("cannot be read (it is a folder, a device or a pipe); name a file");
	if (fs::exists(status) && fs::file_size(file, error) == 0)
		throw std::runtime_error("is empty; copy or save it again");
	read_text(file, 1);
}
}  // namespace d2s1r
