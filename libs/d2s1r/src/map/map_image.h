// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/map_io.h>

#include <functional>

namespace d2s1r
{
/// How the pixels of an image become cells.
struct PixelRule
{
	/// P(occupied) of a pixel's brightness in [0, 1], black to white.
	std::function<double(double)> p_occupied;

	/// A pixel with transparency is unknown; otherwise the mean brightness takes in alpha as if it were a colour.
	bool transparent_is_unknown = true;
};

/// The rule of an image that comes without a yaml file: black is occupied, white is free, and the shade that
/// map_server writes for unknown cells (205) is unknown.
PixelRule plain_image_rule();

/// \throws std::exception saying what is wrong
void check_geometry(const ImageGeometry& geometry);

/// Reads an image of 1, 3 or 4 channels of 8 or 16 bit.
/// \throws std::exception saying what is wrong with the image or its geometry, without its name
mrpt::maps::COccupancyGridMap2D::Ptr load_image_map(
    const std::string& file, const ImageGeometry& geometry, const PixelRule& rule);
}  // namespace d2s1r
