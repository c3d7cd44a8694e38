// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace d2s1r::test
{
/// Two white pixels with alpha, 255 and 0, as PNG; CImage does not write alpha.
inline const std::string kClearPng(
    "\x89\x50\x4e\x47\x0d\x0a\x1a\x0a\x00\x00\x00\x0d\x49\x48\x44\x52\x00\x00\x00\x02\x00\x00\x00\x01"
    "\x08\x06\x00\x00\x00\xf4\x22\x7f\x8a\x00\x00\x00\x0c\x49\x44\x41\x54\x78\x9c\x63\xf8\x0f\x01\x0c"
    "\x00\x22\xe6\x06\xfa\x08\xfa\x02\x27\x00\x00\x00\x00\x49\x45\x4e\x44\xae\x42\x60\x82",
    69);

/// Returns a PNG of one row of grey pixels with alpha, whose data are not packed; CImage does not write alpha.
/// \param pixels shade and alpha
inline std::string png_with_alpha(const std::vector<std::array<int, 2>>& pixels)
{
	const auto big_endian = [](std::uint32_t number)
	{
		std::string bytes;
		for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift & 0xFF);
		return bytes;
	};
	const auto crc = [](const std::string& bytes)
	{
		std::uint32_t sum = 0xFFFFFFFF;
		for (const char byte : bytes)
		{
			sum ^= static_cast<unsigned char>(byte);
			for (int bit = 0; bit < 8; bit++) sum = sum >> 1 ^ (sum & 1 ? 0xEDB88320 : 0);
		}
		return ~sum;
	};
	const auto chunk = [&](const std::string& name_and_data)
	{
		const auto size = static_cast<std::uint32_t>(name_and_data.size() - 4);
		return big_endian(size) + name_and_data + big_endian(crc(name_and_data));
	};
	std::string row(1, '\0');  // without a filter
	for (const auto& [shade, alpha] : pixels)
		row += std::string(3, static_cast<char>(shade)) + static_cast<char>(alpha);
	std::uint32_t a = 1, b = 0;  // of Adler's checksum
	for (const char byte : row)
	{
		a = (a + static_cast<unsigned char>(byte)) % 65521;
		b = (b + a) % 65521;
	}
	const auto low = static_cast<char>(row.size() & 0xFF), high = static_cast<char>(row.size() >> 8);
	const std::string stored =
	    std::string("\x78\x01\x01") + low + high + static_cast<char>(~low) + static_cast<char>(~high);
	return "\x89PNG\r\n\x1a\n" +
	       chunk(
	           "IHDR" + big_endian(static_cast<std::uint32_t>(pixels.size())) + big_endian(1) +
	           std::string("\x08\x06\0\0\0", 5)) +
	       chunk("IDAT" + stored + row + big_endian(b << 16 | a)) + chunk("IEND");
}

/// A folder of its own for a test, gone with it.
class TempFolder
{
   public:
	TempFolder()
	{
		std::string pattern = (std::filesystem::temp_directory_path() / "d2s1r-test-XXXXXX").string();
		if (!mkdtemp(pattern.data())) throw std::runtime_error("cannot make " + pattern);
		path_ = pattern;
	}
	~TempFolder() { std::filesystem::remove_all(path_); }
	TempFolder(const TempFolder&) = delete;
	TempFolder& operator=(const TempFolder&) = delete;

	std::string path(const std::string& name) const { return (path_ / name).string(); }

	/// Writes a file and returns its path.
	std::string write(const std::string& name, const std::string& bytes) const
	{
		std::ofstream(path(name), std::ios::binary) << bytes;
		return path(name);
	}

   private:
	std::filesystem::path path_;
};

/// While it lives, permissions of files count for root, too.
class OrdinaryUser
{
   public:
	OrdinaryUser()
	{
		constexpr uid_t kNobody = 65534;
		if (was_ == 0 && seteuid(kNobody) != 0) throw std::runtime_error("cannot become another user");
	}
	~OrdinaryUser()
	{
		if (was_ == 0 && seteuid(was_) != 0) std::abort();
	}
	OrdinaryUser(const OrdinaryUser&) = delete;
	OrdinaryUser& operator=(const OrdinaryUser&) = delete;

   private:
	uid_t was_ = geteuid();
};

inline std::string read_bytes(const std::string& file)
{
	std::ifstream stream(file, std::ios::binary);
	return {std::istreambuf_iterator<char>(stream), {}};
}

/// What() of the `Error` that `action` throws; empty if it throws none.
template <class Error, class Action>
std::string message_of(Action&& action)
{
	try
	{
		action();
	}
	catch (const Error& error)
	{
		return error.what();
	}
	return {};
}
}  // namespace d2s1r::test
