// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map/map_image.h"

#include <mrpt/core/format.h>
#include <mrpt/img/CImage.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "map/occupancy_map.h"

namespace d2s1r
{
namespace
{
using mrpt::maps::COccupancyGridMap2D;

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

/// Looks at a PNG, JPEG or PNM file before a decoder does, which would write to stderr, take a truncated file, or
/// allocate whatever the header says. Other formats pass.
/// \throws std::runtime_error if the file cannot be read, is empty, truncated, too large for memory, or a PNM whose
///         samples are not of 8 or 16 bit
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

mrpt::img::CImage read_image(const std::string& file)
{
	check_image_header(file);
	mrpt::img::CImage image;
	bool loaded = false;
	try
	{
		constexpr int kAsStored = -1;
		loaded = image.loadFromFile(file, kAsStored);
	}
	catch (const std::exception&)
	{
		loaded = false;  // MRPT's text is many lines long and speaks of its own sources
	}
	if (!loaded) throw std::runtime_error("cannot be decoded as an image; copy it again or convert it to PNG");
	return image;
}

/// Fills `map` from an image of `Value` samples, first image row on top.
template <class Value>
void paint(COccupancyGridMap2D& map, const mrpt::img::CImage& image, const PixelRule& rule)
{
	constexpr std::size_t kWhite = std::numeric_limits<Value>::max();
	const auto channels = static_cast<std::size_t>(image.getChannelCount());
	const bool alpha_is_apart = channels == 4 && rule.transparent_is_unknown;
	const std::size_t averaged = alpha_is_apart ? 3 : channels;
	// By the sum of the averaged channels: millions of pixels, few different sums.
	std::vector<COccupancyGridMap2D::cellType> cell_of_sum(kWhite * averaged + 1);
	for (std::size_t sum = 0; sum < cell_of_sum.size(); sum++)
	{
		const double brightness = static_cast<double>(sum) / static_cast<double>(kWhite * averaged);
		cell_of_sum[sum] = COccupancyGridMap2D::p2l(static_cast<float>(1 - rule.p_occupied(brightness)));
	}
	const int width = static_cast<int>(map.getSizeX()), height = static_cast<int>(map.getSizeY());
	for (int y = 0; y < height; y++)
	{
		const Value* pixel = image.ptrLine<Value>(static_cast<unsigned>(height - 1 - y));
		auto* cell = map.getRow(y);
		for (int x = 0; x < width; x++, pixel += channels)
		{
			std::size_t sum = 0;
			for (std::size_t i = 0; i < averaged; i++) sum += pixel[i];
			if (!alpha_is_apart || pixel[3] == kWhite) cell[x] = cell_of_sum[sum];
		}
	}
}
}  // namespace

PixelRule plain_image_rule()
{
	constexpr double kMapServerUnknown = 205.0 / 255;
	return {[](double brightness)
	        { return std::abs(brightness - kMapServerUnknown) < 0.5 / 255 ? 0.5 : 1 - brightness; }};
}

void check_geometry(const ImageGeometry& geometry)
{
	constexpr double kLeast = ImageGeometry::kLeastResolution, kGreatest = ImageGeometry::kGreatestResolution;
	if (!(geometry.resolution >= kLeast && geometry.resolution <= kGreatest))
		throw std::runtime_error(
		    mrpt::format("the resolution is not %g to %g m / pixel; correct it", kLeast, kGreatest));
	check_map_origin(geometry.origin_x, geometry.origin_y);
}

COccupancyGridMap2D::Ptr load_image_map(const std::string& file, const ImageGeometry& geometry, const PixelRule& rule)
{
	check_geometry(geometry);
	const mrpt::img::CImage image = read_image(file);
	const auto width = image.getWidth(), height = image.getHeight();
	check_map_size(static_cast<double>(width), static_cast<double>(height));
	auto map = make_unknown_map(
	    static_cast<int>(width), static_cast<int>(height), geometry.resolution, geometry.origin_x, geometry.origin_y);
	const auto depth = image.getPixelDepth();
	if (depth == mrpt::img::PixelDepth::D8U)
		paint<std::uint8_t>(*map, image, rule);
	else if (depth == mrpt::img::PixelDepth::D16U)
		paint<std::uint16_t>(*map, image, rule);
	else
		throw std::runtime_error("the image has neither 8 nor 16 bits per sample; convert it to an 8-bit PNG");
	return map;
}
}  // namespace d2s1r
