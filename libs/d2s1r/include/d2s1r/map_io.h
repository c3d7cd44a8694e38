// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/parameters.h>
#include <mrpt/maps/COccupancyGridMap2D.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace d2s1r
{
/// What an image file does not say of itself.
struct ImageGeometry
{
	static constexpr double kLeastResolution = 0.001;  //!< [m / pixel]
	static constexpr double kGreatestResolution = 10;  //!< [m / pixel]

	double resolution = 0;  //!< [m / pixel] between these two
	double origin_x = 0;    //!< [m] map frame, of the lower left corner of the image
	double origin_y = 0;    //!< [m] map frame
};

/// Extensions, in lower case, of the files that load_map() takes for images.
inline constexpr std::array<const char*, 9> kImageExtensions = {".png", ".pgm",  ".pbm", ".ppm", ".bmp",
                                                                ".jpg", ".jpeg", ".tif", ".tiff"};

/// Whether load_map() takes a file for an image, which needs an ImageGeometry: by its name, in upper or lower case.
bool is_image_name(const std::string& file);

/// The same for ROS map_server .yaml.
bool is_yaml_name(const std::string& file);

/// Loads an occupancy map: .simplemap(.gz), .gridmap(.gz), ROS map_server .yaml, an image (needs `image`),
/// a serialized CMultiMetricMap (its first grid) or CSignatureMap2D. Thread-safe.
/// \throws std::runtime_error naming the file and what is wrong with it
mrpt::maps::COccupancyGridMap2D::Ptr load_map(
    const std::string& file, const GridParameters& parameters = {},
    const std::optional<ImageGeometry>& image = std::nullopt);

/// The files that load_map() reads: the map and, if it is a yaml file in order, the image it names.
std::vector<std::string> files_of_map(const std::string& file);

/// The occupancy grid of a map object: a COccupancyGridMap2D, a CMultiMetricMap (its first grid), a CSimpleMap's
/// drawing or a CSignatureMap2D.
/// \throws std::invalid_argument if it holds none, std::runtime_error if a CSimpleMap cannot be drawn
mrpt::maps::COccupancyGridMap2D::Ptr grid_of(
    const mrpt::serialization::CSerializable& map, const GridParameters& parameters = {});

/// A copy whose lower left corner lies at a multiple of the cell size, at most half a cell off: what MRPT can read back
/// from an archive. It rounds both corners of other grids, and the cells do not fit between them any more.
mrpt::maps::COccupancyGridMap2D on_whole_cells(const mrpt::maps::COccupancyGridMap2D& map);
}  // namespace d2s1r
