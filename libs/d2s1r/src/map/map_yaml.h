// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/for_programs.h>

#include <string>

#include "map/map_image.h"

namespace d2s1r
{
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

/// Returns the path of the image.
std::string path_of_image(const std::string& yaml_file, const MapServerYaml& yaml);
}  // namespace d2s1r
