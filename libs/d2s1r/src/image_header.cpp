// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "image_header.h"

#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "occupancy_map.h"

namespace d2s1r
{
namespace
{
bool starts_with(const std::string& bytes, const std::string& start)
{
	return bytes.rfind(start, 0) == 0;
}

std::string read_bytes(const std::string& file)
{
	std::error_code error;
	std::ifstream stream;
	if (std::filesystem::is_regular_file(file, error)) stream.open(file, std::ios::binary);
	if (!stream.is_open())
		throw std::runtime_error("the image cannot be read; check that it exists, is a file and is readable");
	std::ostringstream bytes;
	bytes << stream.rdbuf();
	if (bytes.str().empty()) throw std::runtime_error("the image is empty; copy or save it again");
	return bytes.str();
}

[[noreturn]] void refuse_as_truncated()
{
	throw std::runtime_error("the image is truncated; copy or save it again");
}

void check_end(const std::string& bytes, const std::string& mark)
{
	if (bytes.rfind(mark) == std::string::npos) refuse_as_truncated();
}

void check_png(const std::string& bytes)
{
	constexpr std::size_t kWidthAt = 16, kHeightAt = 20, kHeaderEnd = 24;
	if (bytes.size() < kHeaderEnd) refuse_as_truncated();
	const auto big_endian = [&](std::size_t at)
	{
		double number = 0;
		for (std::size_t i = at; i < at + 4; i++) number = number * 256 + static_cast<unsigned char>(bytes[i]);
		return number;
	};
	check_map_size(big_endian(kWidthAt), big_endian(kHeightAt));
	check_end(bytes, "IEND");
}

/// Portable bitmap, graymap, pixmap: "P5", width, height, greatest value and a blank, then the pixels.
void check_pnm(const std::string& bytes)
{
	std::istringstream text(bytes);
	text.ignore(2);
	const auto next_number = [&]
	{
		while ((text >> std::ws).peek() == '#') text.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
		double number = 0;
		text >> number;
		return number;
	};
	const double width = next_number(), height = next_number();
	const char kind = bytes[1];
	const bool is_bitmap = kind == '1' || kind == '4';
	const double greatest = is_bitmap ? 1 : next_number();
	if (!text || greatest < 1) throw std::runtime_error("the image has a malformed header; convert it to PNG");
	if (!is_bitmap && greatest != 255 && greatest != 65535)
		throw std::runtime_error("the greatest value of the image's samples is not 255 or 65535; convert it to PNG");
	check_map_size(width, height);
	if (kind != '5' && kind != '6') return;  // text or packed bits: no size to compare
	const double size = width * height * (kind == '6' ? 3 : 1) * (greatest > 255 ? 2 : 1);
	if (static_cast<double>(bytes.size()) - static_cast<double>(text.tellg()) - 1 < size) refuse_as_truncated();
}
}  // namespace

void check_image_header(const std::string& file)
{
	const std::string bytes = read_bytes(file);
	if (starts_with(bytes, "\x89PNG"))
		check_png(bytes);
	else if (starts_with(bytes, "\xFF\xD8"))
		check_end(bytes, "\xFF\xD9");
	else if (bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6')
		check_pnm(bytes);
}
}  // namespace d2s1r
