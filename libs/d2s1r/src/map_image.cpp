// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_image.h"

#include <mrpt/core/format.h>
#include <mrpt/img/CImage.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "image_header.h"
#include "occupancy_map.h"

namespace d2s1r
{
namespace
{
using mrpt::maps::COccupancyGridMap2D;

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
