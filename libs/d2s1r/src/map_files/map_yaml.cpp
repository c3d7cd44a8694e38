// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "base/checked_value.h"
#include "base/errors.h"
#include "base/yaml_file.h"
#include "map_files/map_image.h"

namespace d2s1r
{
namespace
{
YAML::Node value_of(const YAML::Node& root, const std::string& key)
{
	if (!root.IsMap() || !root[key]) throw std::runtime_error("the key '" + key + "' is missing; add it");
	return root[key];
}

template <class T>
T read(const YAML::Node& root, const std::string& key, const std::string& expected)
{
	try
	{
		return value_of(root, key).as<T>();
	}
	catch (const YAML::Exception&)
	{
		throw std::runtime_error("'" + key + "' is not " + expected + "; correct it");
	}
}

/// Reads a number, whatever the locale of the program is, on which yaml-cpp's conversion depends.
double number_of(const std::string& text, const std::string& key, const std::string& expected)
{
	try
	{
		return from_text<double>(key, text.rfind('+', 0) == 0 ? text.substr(1) : text);
	}
	catch (const std::invalid_argument&)
	{
		throw std::runtime_error("'" + key + "' is not " + expected + "; correct it");
	}
}

double read_number(const YAML::Node& root, const std::string& key, const std::string& expected)
{
	return number_of(read<std::string>(root, key, expected), key, expected);
}

bool read_negate(const YAML::Node& root)
{
	const auto text = read<std::string>(root, "negate", "0 or 1");
	if (text == "1" || text == "true") return true;
	if (text == "0" || text == "false") return false;
	throw std::runtime_error("'negate' is not 0 or 1; correct it");
}

void check_values(const MapServerYaml& yaml)
{
	check_geometry(yaml.geometry);
	if (yaml.mode != "trinary" && yaml.mode != "scale" && yaml.mode != "raw")
		throw std::runtime_error("mode '" + excerpt(yaml.mode) + "' is not known; use trinary, scale or raw");
	if (yaml.mode == "raw" && yaml.negate)
		throw std::runtime_error(
		    "negate: 1 with mode: raw is read in one way by ROS 1 and in another by ROS 2; set negate to 0");
	if (!(0 <= yaml.free_thresh && yaml.free_thresh < yaml.occupied_thresh && yaml.occupied_thresh <= 1))
		throw std::runtime_error("thresholds are not 0 <= free_thresh < occupied_thresh <= 1; correct them");
}

/// Calls `read` with the path of the image. \throws std::runtime_error naming the image
template <class Read>
auto of_image(const std::string& yaml_file, const MapServerYaml& yaml, const Read& read)
{
	const std::string image = path_of_image(yaml_file, yaml);
	try
	{
		return read(image);
	}
	catch (const std::runtime_error& error)
	{
		throw std::runtime_error(printable(image) + ": " + error.what());
	}
}
}  // namespace

MapServerYaml read_map_yaml(const std::string& file)
{
	const YAML::Node root = read_yaml(file);
	MapServerYaml yaml;
	yaml.image = read<std::string>(root, "image", "a file name");
	if (yaml.image.find('\0') != std::string::npos) throw std::runtime_error("'image' is not a file name; correct it");
	yaml.geometry.resolution = read_number(root, "resolution", "a number of metres");
	const std::string pose = "[x, y, yaw] in m and rad";
	const auto origin = read<std::vector<std::string>>(root, "origin", pose);
	if (origin.size() != 3) throw std::runtime_error("'origin' is not " + pose + "; correct it");
	yaml.geometry.origin_x = number_of(origin[0], "origin", pose);
	yaml.geometry.origin_y = number_of(origin[1], "origin", pose);
	yaml.negate = read_negate(root);
	yaml.occupied_thresh = read_number(root, "occupied_thresh", "a probability");
	yaml.free_thresh = read_number(root, "free_thresh", "a probability");
	if (root["mode"]) yaml.mode = read<std::string>(root, "mode", "trinary, scale or raw");
	yaml.geometry.origin_yaw = number_of(origin[2], "origin", pose);
	check_values(yaml);
	return yaml;
}

std::string path_of_image(const std::string& yaml_file, const MapServerYaml& yaml)
{
	return (std::filesystem::path(yaml_file).parent_path() / yaml.image).string();
}

double MapServerYaml::occupancy(double brightness) const
{
	if (mode == "raw") return std::round(255 * brightness) / 100;  // the values of nav_msgs/OccupancyGrid
	return negate ? brightness : 1 - brightness;
}

PixelRule MapServerYaml::rule() const
{
	const auto p_occupied = [yaml = *this](double brightness)
	{
		const double occupancy = yaml.occupancy(brightness);
		if (yaml.mode == "raw") return occupancy > 1 ? 0.5 : occupancy;
		if (occupancy > yaml.occupied_thresh) return 1.0;
		if (occupancy < yaml.free_thresh) return 0.0;
		if (yaml.mode == "trinary") return 0.5;
		return (occupancy - yaml.free_thresh) / (yaml.occupied_thresh - yaml.free_thresh);
	};
	return {p_occupied, mode == "scale"};
}

OccupancyMap load_yaml_map(const std::string& yaml_file, MapChange change)
{
	MapServerYaml yaml = read_map_yaml(yaml_file);
	if (change == MapChange::kNegated) yaml.negate = !yaml.negate;
	if (change == MapChange::kScaled) yaml.mode = "scale";
	if (change == MapChange::kRaw) yaml.mode = "raw", yaml.negate = false;
	return of_image(
	    yaml_file, yaml, [&](const std::string& image) { return load_image_map(image, yaml.geometry, yaml.rule()); });
}

std::string image_of_yaml_map(const std::string& yaml_file)
{
	return path_of_image(yaml_file, read_map_yaml(yaml_file));
}

LostCells lost_cells_of_yaml(const std::string& yaml_file, const GridParameters& parameters)
{
	const MapServerYaml yaml = read_map_yaml(yaml_file);
	return of_image(
	    yaml_file, yaml, [&](const std::string& image) { return find_lost_cells(image, yaml, parameters); });
}
}  // namespace d2s1r
