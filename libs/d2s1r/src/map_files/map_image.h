// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/changed_map.h>
#include <d2s1r/lost_cells.h>
#include <d2s1r/map_io.h>

#include <functional>

#include "map_files/image_decoders.h"

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

/// Returns whether an image is of a format that changes shades a little, by its name.
bool is_lossy_image_name(const std::string& file);

/// Returns the rule of an image that comes without a yaml file: black is occupied, white is free, and the shade that
/// map_server writes for unknown cells (205) is unknown.
PixelRule plain_image_rule();

/// Checks that resolution and origin are in range.
/// \throws std::exception saying what is wrong
void check_geometry(const ImageGeometry& geometry);

/// Reads an image of 1, 3 or 4 channels of 8 or 16 bit.
/// \throws std::exception saying what is wrong with the image or its geometry, without its name
OccupancyMap load_image_map(const std::string& file, const ImageGeometry& geometry, const PixelRule& rule);

/// Paints an image whose pixels are cells. \throws std::exception
OccupancyMap paint_along_axes(const Image& image, const ImageGeometry& geometry, const PixelRule& rule);

/// Returns the memory [byte] that unpacking a PNG, JPEG, BMP, TIFF or PNM file takes at most. It looks at the bytes of
/// the file before a decoder does, which would write to stderr, take a truncated file, or allocate whatever the header
/// says.
/// \throws std::runtime_error if it is another file, an image that is truncated or too large for memory, or a PNM whose
///         samples are not of 8 or 16 bit
double memory_to_decode(const std::string& bytes);

/// Reads an image of one of these formats. \throws std::exception saying what is wrong, without its name
Image read_image(const std::string& file);

/// Holds what a yaml file of ROS map_server says.
struct MapServerYaml
{
	std::string image;
	ImageGeometry geometry;
	std::string mode = "trinary";
	bool negate = false;
	double occupied_thresh = 0;  //!< [probability]
	double free_thresh = 0;      //!< [probability]

	/// Returns P(occupied) that the yaml file reads in the brightness of a pixel in [0, 1], before any threshold; above
	/// 1 if it says that the cell is unknown.
	double occupancy(double brightness) const;

	/// Returns the rule of map_server's loadMapFromFile() and nav2's map_io.
	PixelRule rule() const;
};

/// Reads such a file. \throws std::runtime_error that does not name the file
MapServerYaml read_map_yaml(const std::string& yaml_file);

/// Looks at what becomes of the pixels of the image, see lost_cells(). \throws std::runtime_error without its name
LostCells find_lost_cells(const std::string& image, const MapServerYaml& yaml, const GridParameters& parameters);

std::string path_of_image(const std::string& yaml_file, const MapServerYaml& yaml);

/// Reads a map of ROS map_server: a yaml file and the image it names, in modes trinary, scale and raw. An
/// occupied cell gets P(occupied) 1, a free one 0 and an unknown one 0.5, in between only in modes scale and raw.
/// Of an image that the origin's yaw turns, cells along the axes of the map frame are made, see ImageGeometry. MRPT's
/// own reader ignores that yaw and moves the origin to a multiple of the cell size.
/// \throws std::exception saying what is wrong, without the name of the yaml file
OccupancyMap load_yaml_map(const std::string& yaml_file, MapChange change = MapChange::kNone);

/// Looks at what becomes of the pixels of a yaml map, see lost_cells(). \throws std::exception like load_yaml_map()
LostCells lost_cells_of_yaml(const std::string& yaml_file, const GridParameters& parameters);

/// Returns the path of the image that such a yaml file names.
/// \throws std::exception if the yaml file cannot be read or is not as it should be
std::string image_of_yaml_map(const std::string& yaml_file);
}  // namespace d2s1r
