// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/occupancy_map.h>
#include <d2s1r/parameters.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace d2s1r
{
/// Describes what the file of an image does not hold: how large a pixel is, and where the image lies in the map frame.
struct ImageGeometry
{
	static constexpr double kLeastResolution = 0.001;  //!< [m / pixel]
	static constexpr double kGreatestResolution = 10;  //!< [m / pixel]

	double resolution = 0;  //!< [m / pixel] from kLeastResolution to kGreatestResolution
	double origin_x = 0;    //!< [m] map frame, of the lower left corner of the image
	double origin_y = 0;    //!< [m] map frame
	/// [rad] How the image is turned about that corner in the map frame, counter-clockwise. Cells lie along the axes of
	/// the map frame: each gets the pixel that its centre lies in, and those outside the image are unknown.
	double origin_yaw = 0;
};

/// Lists the extensions, in lower case, of the files that load_map() reads as images.
inline constexpr std::array<const char*, 9> kImageExtensions = {".png", ".pgm",  ".pbm", ".ppm", ".bmp",
                                                                ".jpg", ".jpeg", ".tif", ".tiff"};

/// Returns whether load_map() reads a file as an image, which needs an ImageGeometry. The name decides, in upper or
/// lower case.
bool is_image_name(const std::string& file);

/// Returns whether load_map() reads a file as a yaml file of ROS map_server. The name decides, in upper or lower case.
bool is_yaml_name(const std::string& file);

/// Loads an occupancy map: .simplemap(.gz), .gridmap(.gz), ROS map_server .yaml, an image (needs `image`),
/// a serialized CMultiMetricMap (its first grid) or CSignatureMap2D. Thread-safe.
/// \throws std::runtime_error naming the file and what is wrong with it
std::shared_ptr<const OccupancyMap> load_map(
    const std::string& file, const GridParameters& parameters = {},
    const std::optional<ImageGeometry>& image = std::nullopt);

/// Returns the files that load_map() reads: the map itself and, if it is a sound yaml file, the image that it names.
std::vector<std::string> files_of_map(const std::string& file);

/// Makes a map of the probabilities that its cells are occupied.
/// \param p_occupied [probability] row-major, the row of least y first; NaN is unknown
/// \param width [cells] of a row
/// \param geometry a pixel is a cell; its origin is kept exactly
/// \throws std::invalid_argument if a probability is not in [0, 1], the last row is not whole, the geometry is out of
///         range, or the map is empty or too large for memory
std::shared_ptr<const OccupancyMap> map_of_cells(
    const std::vector<float>& p_occupied, std::size_t width, const ImageGeometry& geometry);

/// Checks whether map_of_cells() takes so many cells, before anybody makes room for them.
/// \throws std::invalid_argument if there is no cell, or there are too many for memory
void check_number_of_cells(std::size_t width, std::size_t height);

/// Returns the fingerprint of a map, which identifies the map that an index was saved for. Fingerprints are equal if
/// the bytes of the files that load_map() reads and `image` are equal. This is faster than loading the map.
/// Thread-safe. \throws std::runtime_error naming the file if one cannot be read
std::uint64_t fingerprint_of_map(const std::string& file, const std::optional<ImageGeometry>& image = std::nullopt);

/// Returns the fingerprint of a map in memory. It is equal for equal cells, size, resolution and origin.
std::uint64_t fingerprint_of_map(const OccupancyMap& map);
}  // namespace d2s1r
