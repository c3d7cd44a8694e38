// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/file_text.h"

#include <fcntl.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <set>
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

/// An open file, or a negative number.
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

YAML::Node read_yaml(const std::string& file)
{
	constexpr std::size_t kLongestFile = 1 << 18;  // [byte] an atlas of a thousand maps has half of that
	check_readable(file);
	const std::string text = read_text(file, kLongestFile + 1);
	if (text.size() > kLongestFile)
		throw std::runtime_error("is longer than 256 kB; name the yaml file of a map or an atlas");
	try
	{
		const YAML::Node root = YAML::Load(text);
		check_keys(root);
		return root;
	}
	catch (const YAML::Exception& error)
	{
		throw std::runtime_error(
		    "line " + std::to_string(error.mark.line + 1) + " is not yaml (" + excerpt(error.msg) + "); correct it");
	}
}

void check_keys(const YAML::Node& map)
{
	std::set<std::string> seen;
	if (!map.IsMap()) return;
	for (const auto& item : map)
		if (item.first.IsScalar() && !seen.insert(item.first.Scalar()).second)
			throw std::runtime_error("the key '" + excerpt(item.first.Scalar()) + "' is given twice; keep one");
}
}  // namespace d2s1r
