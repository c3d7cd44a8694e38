// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map/map_image.h"

#include <d2s1r/version.h>
#include <mrpt/core/format.h>
#include <mrpt/img/CImage.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "base/file_text.h"
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
	const auto status = std::filesystem::status(file, error);
	if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
		throw std::runtime_error(
		    "the image cannot be read (it is a folder, a device or a pipe); name the file of an image");
	try
	{
		const std::string bytes = read_text(file);
		if (!bytes.empty()) return bytes;
	}
	catch (const std::runtime_error& reason)
	{
		throw std::runtime_error(std::string("the image ") + reason.what());
	}
	throw std::runtime_error("the image is empty; copy or save it again");
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

/// The header of a portable bitmap, graymap or pixmap: "P5", width, height, the greatest value but for bitmaps, and a
/// blank; then the samples.
struct PnmHeader
{
	char kind = 0;               //!< '1' to '6'
	double width = 0;            //!< [pixel]
	double height = 0;           //!< [pixel]
	double greatest = 1;         //!< of a sample
	std::size_t samples_at = 0;  //!< [byte]

	bool is_text() const { return kind <= '3'; }
	bool is_bitmap() const { return kind == '1' || kind == '4'; }
	int channels() const { return kind == '3' || kind == '6' ? 3 : 1; }
};

bool is_pnm(const std::string& bytes)
{
	return bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6';
}

void skip_blanks_and_comments(std::istream& text)
{
	while ((text >> std::ws).peek() == '#') text.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
}

PnmHeader read_pnm_header(std::istream& text)
{
	PnmHeader header;
	text.ignore(1).get(header.kind);
	const auto next_number = [&]
	{
		skip_blanks_and_comments(text);
		double number = 0;
		text >> number;
		return number;
	};
	header.width = next_number();
	header.height = next_number();
	if (!header.is_bitmap()) header.greatest = next_number();
	if (!text || header.greatest < 1) throw std::runtime_error("the image has a malformed header; convert it to PNG");
	if (!header.is_bitmap() && header.greatest != 255 && header.greatest != 65535)
		throw std::runtime_error("the greatest value of the image's samples is not 255 or 65535; convert it to PNG");
	check_map_size(header.width, header.height);
	header.samples_at = static_cast<std::size_t>(text.tellg()) + 1;
	return header;
}

void check_pnm(const std::string& bytes)
{
	std::istringstream text(bytes);
	const PnmHeader header = read_pnm_header(text);
	const double samples = header.width * header.height * header.channels();
	const double per_sample = header.kind == '4'                           ? 1.0 / 8
	                          : header.is_text() || header.greatest <= 255 ? 1
	                                                                       : 2;  // [byte]
	if (static_cast<double>(bytes.size()) - static_cast<double>(header.samples_at) < samples * per_sample)
		refuse_as_truncated();
}

/// Returns a sample that is written as a number, or as a digit in a bitmap, where 1 is black.
unsigned next_text_sample(std::istream& text, const PnmHeader& header)
{
	skip_blanks_and_comments(text);
	if (header.is_bitmap())
	{
		const int digit = text.get();
		if (digit == std::char_traits<char>::eof()) refuse_as_truncated();
		return digit == '1' ? 0 : 255;
	}
	unsigned sample = 0;
	if (!(text >> sample)) refuse_as_truncated();
	return std::min(sample, static_cast<unsigned>(header.greatest));
}

/// Decodes a PNM file whose samples are written as text. OpenCV refuses such a file if nothing follows the last sample.
mrpt::img::CImage decode_text_pnm(const std::string& bytes)
{
	std::istringstream text(bytes);
	const PnmHeader header = read_pnm_header(text);
	const auto width = static_cast<unsigned>(header.width), height = static_cast<unsigned>(header.height);
	const bool is_16_bit = header.greatest > 255;
	mrpt::img::CImage image;
	image.resize(
	    width, height, header.channels() == 3 ? mrpt::img::CH_RGB : mrpt::img::CH_GRAY,
	    is_16_bit ? mrpt::img::PixelDepth::D16U : mrpt::img::PixelDepth::D8U);
	const std::size_t samples = std::size_t{width} * static_cast<std::size_t>(header.channels());
	for (unsigned y = 0; y < height; y++)
		for (std::size_t i = 0; i < samples; i++)
		{
			const unsigned sample = next_text_sample(text, header);
			if (is_16_bit)
				image.ptrLine<std::uint16_t>(y)[i] = static_cast<std::uint16_t>(sample);
			else
				image.ptrLine<std::uint8_t>(y)[i] = static_cast<std::uint8_t>(sample);
		}
	return image;
}

mrpt::img::CImage read_image(const std::string& file)
{
	const std::string bytes = read_bytes(file);
	check_image(bytes);
	if (is_pnm(bytes) && bytes[1] <= '3') return decode_text_pnm(bytes);
	mrpt::img::CImage image;
	bool loaded = false;
	try
	{
		loaded = image.loadFromFile(file, kChannelsAsStored);
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
	const auto channels = channels_of(image);
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

void check_image(const std::string& bytes)
{
	if (starts_with(bytes, "\x89PNG"))
		check_png(bytes);
	else if (starts_with(bytes, "\xFF\xD8"))
		check_end(bytes, "\xFF\xD9");
	else if (is_pnm(bytes))
		check_pnm(bytes);
}

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
	if (!std::isfinite(geometry.origin_yaw))
		throw std::runtime_error("the yaw of the origin is not finite; correct it");
}

namespace
{
/// Paints an image whose pixels are cells.
COccupancyGridMap2D::Ptr paint_along_axes(
    const mrpt::img::CImage& image, const ImageGeometry& geometry, const PixelRule& rule)
{
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

/// Returns the map turned about its lower left corner by geometry.origin_yaw, in cells along the axes.
COccupancyGridMap2D::Ptr along_axes(const COccupancyGridMap2D::Ptr& image, const ImageGeometry& geometry)
{
	constexpr double kNoYaw = 1e-6;  // [rad]
	if (std::abs(geometry.origin_yaw) < kNoYaw) return image;
	const COccupancyGridMap2D& map = *image;
	const double c = std::cos(geometry.origin_yaw), s = std::sin(geometry.origin_yaw);
	const double w = map.getSizeX(), h = map.getSizeY();  // [cells], as all lengths here
	const auto bounds = std::minmax({0.0, c * w, -s * h, c * w - s * h});
	const auto bounds_y = std::minmax({0.0, s * w, c * h, s * w + c * h});
	constexpr double kRounding = 1e-6;
	const double x0 = bounds.first, y0 = bounds_y.first;
	const double width = std::ceil(bounds.second - x0 - kRounding),
	             height = std::ceil(bounds_y.second - y0 - kRounding);
	check_map_size(width, height);
	auto grid = make_unknown_map(
	    static_cast<int>(width), static_cast<int>(height), geometry.resolution,
	    geometry.origin_x + x0 * geometry.resolution, geometry.origin_y + y0 * geometry.resolution);
	for (int row = 0; row < static_cast<int>(height); row++)
		for (int column = 0; column < static_cast<int>(width); column++)
		{
			const double x = x0 + column + 0.5, y = y0 + row + 0.5;
			const double u = std::floor(c * x + s * y), v = std::floor(c * y - s * x);
			if (u < 0 || v < 0 || u >= w || v >= h) continue;
			grid->getRow(row)[column] = map.getRow(static_cast<int>(v))[static_cast<int>(u)];
		}
	return grid;
}
}  // namespace

COccupancyGridMap2D::Ptr load_image_map(const std::string& file, const ImageGeometry& geometry, const PixelRule& rule)
{
	check_geometry(geometry);
	return along_axes(paint_along_axes(read_image(file), geometry, rule), geometry);
}

double share_of_pixels(const std::string& file, const std::function<bool(double)>& matches)
{
	const PixelRule rule = {[&](double brightness) { return matches(brightness) ? 1.0 : 0.0; }};
	const auto map = paint_along_axes(read_image(file), {1, 0, 0}, rule);
	const auto occupied = COccupancyGridMap2D::p2l(0.0F);
	std::size_t count = 0;
	for (int row = 0; row < static_cast<int>(map->getSizeY()); row++)
		count += static_cast<std::size_t>(std::count(map->getRow(row), map->getRow(row) + map->getSizeX(), occupied));
	return static_cast<double>(count) / (static_cast<double>(map->getSizeX()) * map->getSizeY());
}

COccupancyGridMap2D::Ptr map_of_cells(
    const std::vector<float>& p_occupied, std::size_t width, const ImageGeometry& geometry)
try
{
	check_geometry(geometry);
	const std::size_t height = width > 0 ? p_occupied.size() / width : 0;
	check_map_size(static_cast<double>(width), static_cast<double>(height));
	if (width * height != p_occupied.size())
		throw std::invalid_argument("the last row is not whole; give width times height cells");
	auto map = make_unknown_map(
	    static_cast<int>(width), static_cast<int>(height), geometry.resolution, geometry.origin_x, geometry.origin_y);
	for (std::size_t i = 0; i < p_occupied.size(); i++)
	{
		const float p = p_occupied[i];
		if (std::isnan(p)) continue;
		if (!(p >= 0 && p <= 1))
			throw std::invalid_argument(mrpt::format(
			    "the cell of column %zu and row %zu is %g, which is no probability; give 0 for free to 1 for occupied "
			    "and NaN for unknown",
			    i % width, i / width, static_cast<double>(p)));
		map->getRow(static_cast<int>(i / width))[i % width] = COccupancyGridMap2D::p2l(1 - p);
	}
	return along_axes(map, geometry);
}
catch (const std::logic_error& error)
{
	throw std::invalid_argument(std::string("map_of_cells: ") + error.what());
}
catch (const std::runtime_error& error)
{
	throw std::invalid_argument(std::string("map_of_cells: ") + error.what());
}
}  // namespace d2s1r
