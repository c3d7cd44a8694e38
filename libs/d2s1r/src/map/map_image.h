// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/map_io.h>

#include <functional>

namespace d2s1r
{
/// Says how the pixels of an image become cells.
struct PixelRule
{
	/// Returns P(occupied) for the brightness of a pixel in [0, 1], from black to white.
	std::function<double(double)> p_occupied;

	/// Says whether a pixel with transparency is unknown; otherwise alpha counts in the mean brightness as if it were a
	/// colour.
	bool transparent_is_unknown = true;
};

/// Returns the rule of an image that comes without a yaml file: black is occupied, white is free, and the shade that
/// map_server writes for unknown cells (205) is unknown.
PixelRule plain_image_rule();

/// Checks that resolution and origin are in range.
/// \throws std::exception saying what is wrong
void check_geometry(const ImageGeometry& geometry);

/// Reads an image of 1, 3 or 4 channels of 8 or 16 bit.
/// \throws std::exception saying what is wrong with the image or its geometry, without its name
mrpt::maps::COccupancyGridMap2D::Ptr load_image_map(
    const std::string& file, const ImageGeometry& geometry, const PixelRule& rule);

/// Returns the share [0, 1] of the pixels of an image whose brightness, in [0, 1], `matches`. \throws std::exception
double share_of_pixels(const std::string& file, const std::function<bool(double)>& matches);

/// Looks at the bytes of a PNG, JPEG or PNM file before a decoder does, which would write to stderr, take a truncated
/// file, or allocate whatever the header says. Other formats pass.
/// \throws std::runtime_error if the image is truncated, too large for memory, or a PNM whose samples are not of 8 or
///         16 bit
void check_image(const std::string& bytes);
}  // namespace d2s1r
