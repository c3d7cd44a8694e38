// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/parameters.h>
#include <mrpt/maps/COccupancyGridMap2D.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace d2s1r
{
/// Says of an image what its file does not: how large a pixel is, and where the image lies in the map frame.
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

/// Lists the extensions, in lower case, of the files that load_map() takes for images.
inline constexpr std::array<const char*, 9> kImageExtensions = {".png", ".pgm",  ".pbm", ".ppm", ".bmp",
                                                                ".jpg", ".jpeg", ".tif", ".tiff"};

/// Returns whether load_map() takes a file for an image, which needs an ImageGeometry. It goes by the name, in upper or
/// lower case.
bool is_image_name(const std::string& file);

/// Returns whether load_map() takes a file for a yaml file of ROS map_server. It goes by the name, in upper or lower
/// case.
bool is_yaml_name(const std::string& file);

/// Loads an occupancy map: .simplemap(.gz), .gridmap(.gz), ROS map_server .yaml, an image (needs `image`),
/// a serialized CMultiMetricMap (its first grid) or CSignatureMap2D. Thread-safe.
/// \throws std::runtime_error naming the file and what is wrong with it
mrpt::maps::COccupancyGridMap2D::Ptr load_map(
    const std::string& file, const GridParameters& parameters = {},
    const std::optional<ImageGeometry>& image = std::nullopt);

<<<<<<< HEAD
=======
/// Says what a yaml file makes of its image that whoever drew it may not have meant.
struct LostCells
{
	/// [0, 1] Share of the pixels that have the shade of unknown cells, 205, and become free. map_server writes that
	/// shade, and `free_thresh: 0.25`, which is often seen beside it, makes such cells free.
	double unknown_made_free = 0;
	bool by_alpha = false;  //!< whether they do because an alpha channel counts as a colour, as map_server has it
	/// [0, 1] Share of the pixels that are light, but lie between the thresholds and become unknown.
	double free_made_unknown = 0;
	bool most_free_is_lost = false;  //!< whether these are more than the light pixels that become free
};

/// Looks at the finished cells of a yaml map; other maps have lost none.
/// \throws std::runtime_error saying what is wrong, without the name of the yaml file
LostCells lost_cells(const std::string& file);

/// Says what of a yaml file is read in another way than it says.
enum class YamlChange
{
	kNone,
	kNegated,  //!< `negate` the other way round
	kScaled    //!< `mode: scale`
};

/// Loads a yaml map in another way than its file says, to find out what is wrong with it.
/// \throws std::runtime_error naming the file and what is wrong with it
mrpt::maps::COccupancyGridMap2D::Ptr load_changed_map(const std::string& file, YamlChange change);

>>>>>>> 660a934 (WIP4: maps and truths)
/// Returns the files that load_map() reads: the map itself and, if it is a sound yaml file, the image that it names.
std::vector<std::string> files_of_map(const std::string& file);

/// Makes a map of the probabilities that its cells are occupied.
/// \param p_occupied [probability] row-major, the row of least y first; NaN is unknown
/// \param width [cells] of a row
/// \param geometry a pixel is a cell; its origin is kept exactly
/// \throws std::invalid_argument if a probability is not in [0, 1], the last row is not whole, the geometry is out of
///         range, or the map is empty or too large for memory
mrpt::maps::COccupancyGridMap2D::Ptr map_of_cells(
    const std::vector<float>& p_occupied, std::size_t width, const ImageGeometry& geometry);

/// Checks whether map_of_cells() takes so many cells, before anybody makes room for them.
/// \throws std::invalid_argument if there is no cell, or there are too many for memory
void check_number_of_cells(std::size_t width, std::size_t height);

/// Returns a number that tells whether a map is the one that an index was saved for: it is equal for equal bytes of the
/// files that load_map() reads and an equal `image`. This is faster than loading the map. Thread-safe.
/// \throws std::runtime_error naming the file if one cannot be read
std::uint64_t fingerprint_of_map(const std::string& file, const std::optional<ImageGeometry>& image = std::nullopt);

/// Returns such a number for a map in memory: it is equal for equal cells, size, resolution and origin.
std::uint64_t fingerprint_of_map(const mrpt::maps::COccupancyGridMap2D& map);

/// Returns the occupancy grid of a map object: of a COccupancyGridMap2D, a CMultiMetricMap (its first grid) or a
/// CSignatureMap2D, or drawn from the scans of a CSimpleMap.
/// \throws std::invalid_argument if it holds none, std::runtime_error if a CSimpleMap cannot be drawn
mrpt::maps::COccupancyGridMap2D::Ptr grid_of(
    const mrpt::serialization::CSerializable& map, const GridParameters& parameters = {});

/// Returns a copy whose lower left corner lies at a multiple of the cell size, at most half a cell off. MRPT can read
/// only such grids back from an archive: it rounds both corners of others, and their cells do not fit any more.
mrpt::maps::COccupancyGridMap2D on_whole_cells(const mrpt::maps::COccupancyGridMap2D& map);
}  // namespace d2s1r
