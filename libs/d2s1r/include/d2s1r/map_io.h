// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/parameters.h>
#include <mrpt/maps/COccupancyGridMap2D.h>

#include <optional>
#include <string>
#include <vector>

namespace d2s1r
{
/// What an image file does not say of itself.
struct ImageGeometry
{
	double resolution = 0;  //!< [m / pixel]
	double origin_x = 0;    //!< [m] map frame, of the lower left corner of the image
	double origin_y = 0;    //!< [m] map frame
};

/// Loads an occupancy map: .simplemap(.gz), .gridmap(.gz), ROS map_server .yaml, an image (needs `image`),
/// a serialized CMultiMetricMap (its first grid) or CSignatureMap2D.
/// \throws std::runtime_error naming the file and what is wrong with it
mrpt::maps::COccupancyGridMap2D::Ptr load_map(
    const std::string& file, const GridParameters& parameters = {},
    const std::optional<ImageGeometry>& image = std::nullopt);

/// The files that load_map() reads: the map and, if it is a yaml file in order, the image it names.
std::vector<std::string> files_of_map(const std::string& file);

/// The occupancy grid of a map object: a COccupancyGridMap2D, a CMultiMetricMap (its first grid), a CSimpleMap's
/// drawing or a CSignatureMap2D.
/// \throws std::invalid_argument if it holds none
mrpt::maps::COccupancyGridMap2D::Ptr grid_of(
    const mrpt::serialization::CSerializable& map, const GridParameters& parameters = {});

/// A copy whose lower left corner lies at a multiple of the cell size, at most half a cell off: what MRPT can read back
/// from an archive. It rounds both corners of other grids, and the cells do not fit between them any more.
mrpt::maps::COccupancyGridMap2D on_whole_cells(const mrpt::maps::COccupancyGridMap2D& map);
}  // namespace d2s1r
