// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_files/map_image.h"

#include <d2s1r/map_limits.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace d2s1r
{
namespace
{
/// Fills `map` from an image of `Value` samples, first image row on top.
template <class Value>
void paint(OccupancyMap& map, const Image& image, const PixelRule& rule)
{
	constexpr std::size_t kWhite = std::numeric_limits<Value>::max();
	const auto channels = static_cast<std::size_t>(image.channels);
	const bool alpha_is_apart = channels == 4 && rule.transparent_is_unknown;
	const std::size_t averaged = alpha_is_apart ? 3 : channels;
	// By the sum of the averaged channels: millions of pixels, few different sums.
	std::vector<std::int8_t> cell_of_sum(kWhite * averaged + 1);
	for (std::size_t sum = 0; sum < cell_of_sum.size(); sum++)
	{
		const double brightness = static_cast<double>(sum) / static_cast<double>(kWhite * averaged);
		cell_of_sum[sum] = OccupancyMap::cell_of(static_cast<float>(1 - rule.p_occupied(brightness)));
	}
	for (int y = 0; y < map.height; y++)
	{
		const Value* pixel = image.row<Value>(map.height - 1 - y);
		std::int8_t* cell = map.row(y);
		for (int x = 0; x < map.width; x++, pixel += channels)
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
	if (!(std::abs(geometry.origin_yaw) <= 2 * M_PI))
		throw std::runtime_error("the yaw of the origin is not -2 pi to 2 pi rad; correct it");
}

OccupancyMap paint_along_axes(const Image& image, const ImageGeometry& geometry, const PixelRule& rule)
{
	auto map = unknown_map(image.width, image.height, geometry.resolution, geometry.origin_x, geometry.origin_y);
	if (image.is_16_bit)
		paint<std::uint16_t>(map, image, rule);
	else
		paint<std::uint8_t>(map, image, rule);
	return map;
}

namespace
{
/// Returns the map turned about its lower left corner by geometry.origin_yaw, in cells along the axes.
OccupancyMap along_axes(OccupancyMap map, const ImageGeometry& geometry)
{
	constexpr double kNoYaw = 1e-6;  // [rad]
	if (std::abs(geometry.origin_yaw) < kNoYaw) return map;
	const double c = std::cos(geometry.origin_yaw), s = std::sin(geometry.origin_yaw);
	const double w = map.width, h = map.height;  // [cells], as all lengths here
	const auto bounds = std::minmax({0.0, c * w, -s * h, c * w - s * h});
	const auto bounds_y = std::minmax({0.0, s * w, c * h, s * w + c * h});
	constexpr double kRounding = 1e-6;
	const double x0 = bounds.first, y0 = bounds_y.first;
	const double width = std::ceil(bounds.second - x0 - kRounding),
	             height = std::ceil(bounds_y.second - y0 - kRounding);
	check_map_size(width, height);
	auto grid = unknown_map(
	    static_cast<int>(width), static_cast<int>(height), geometry.resolution,
	    geometry.origin_x + x0 * geometry.resolution, geometry.origin_y + y0 * geometry.resolution);
	for (int row = 0; row < static_cast<int>(height); row++)
		for (int column = 0; column < static_cast<int>(width); column++)
		{
			const double x = x0 + column + 0.5, y = y0 + row + 0.5;
			const double u = std::floor(c * x + s * y), v = std::floor(c * y - s * x);
			if (u < 0 || v < 0 || u >= w || v >= h) continue;
			grid.row(row)[column] = map.row(static_cast<int>(v))[static_cast<int>(u)];
		}
	return grid;
}
}  // namespace

OccupancyMap load_image_map(const std::string& file, const ImageGeometry& geometry, const PixelRule& rule)
{
	check_geometry(geometry);
	return along_axes(paint_along_axes(read_image(file), geometry, rule), geometry);
}

void check_number_of_cells(std::size_t width, std::size_t height)
try
{
	check_map_size(static_cast<double>(width), static_cast<double>(height));
}
catch (const std::runtime_error& error)
{
	throw std::invalid_argument(error.what());
}

std::shared_ptr<const OccupancyMap> map_of_cells(
    const std::vector<float>& p_occupied, std::size_t width, const ImageGeometry& geometry)
try
{
	check_geometry(geometry);
	const std::size_t height = width > 0 ? p_occupied.size() / width : 0;
	check_map_size(static_cast<double>(width), static_cast<double>(height));
	if (width * height != p_occupied.size())
		throw std::invalid_argument("the last row is not whole; give width times height cells");
	auto map = unknown_map(
	    static_cast<int>(width), static_cast<int>(height), geometry.resolution, geometry.origin_x, geometry.origin_y);
	for (std::size_t i = 0; i < p_occupied.size(); i++)
	{
		const float p = p_occupied[i];
		if (std::isnan(p)) continue;
		if (!(p >= 0 && p <= 1))
			throw std::invalid_argument(mrpt::format(
			    "the cell of column %zu and row %zu is %g, which is not a probability; give 0 for free to 1 for "
			    "occupied "
			    "and NaN for unknown",
			    i % width, i / width, static_cast<double>(p)));
		map.cells[i] = OccupancyMap::cell_of(1 - p);
	}
	return std::make_shared<const OccupancyMap>(along_axes(std::move(map), geometry));
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
