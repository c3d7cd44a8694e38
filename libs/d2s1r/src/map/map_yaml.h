// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/map_io.h>

namespace d2s1r
{
/// Reads a map of ROS map_server: a yaml file and the image it names, in modes trinary and scale. In MRPT's map an
/// occupied cell gets P(occupied) 1, a free one 0 and an unknown one 0.5, in between only in mode scale.
/// Of an image that the origin's yaw turns, cells along the axes of the map frame are made, see ImageGeometry. MRPT's
/// own reader ignores that yaw and moves the origin to a multiple of the cell size.
/// \throws std::exception saying what is wrong, without the name of the yaml file
mrpt::maps::COccupancyGridMap2D::Ptr load_yaml_map(const std::string& yaml_file);

/// Returns the path of the image that such a yaml file names.
/// \throws std::exception if the yaml file cannot be read or is not as it should be
std::string image_of_yaml_map(const std::string& yaml_file);
}  // namespace d2s1r
