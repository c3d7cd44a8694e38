// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/map_io.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "base/file_text.h"
#include "base/index_file.h"
#include "map/map_image.h"
#include "map/occupancy_map.h"

namespace d2s1r
{
namespace
{
using mrpt::maps::COccupancyGridMap2D;
namespace fs = std::filesystem;

std::string lower_case_extension(const std::string& file)
{
	std::string extension = fs::path(file).extension().string();
	std::transform(
	    extension.begin(), extension.end(), extension.begin(),
	    [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
	return extension;
}
}  // namespace

bool is_yaml_name(const std::string& file)
{
	const std::string extension = lower_case_extension(file);
	return extension == ".yaml" || extension == ".yml";
}

bool is_image_name(const std::string& file)
{
	const auto& known = kImageExtensions;
	return std::find(known.begin(), known.end(), lower_case_extension(file)) != known.end();
}

bool is_lossy_image_name(const std::string& file)
{
	const std::string extension = lower_case_extension(file);
	return extension == ".jpg" || extension == ".jpeg";
}

std::vector<std::string> files_of_map(const std::string& file)
{
	if (!is_yaml_name(file)) return {file};
	try
	{
		check_readable(file);
		return {file, image_of_yaml_map(file)};
	}
	catch (const std::exception&)
	{
		return {file};  // load_map() says what is wrong with it
	}
}

std::uint64_t fingerprint_of_map(const std::string& file, const std::optional<ImageGeometry>& image)
{
	std::uint64_t fingerprint = 0;
	if (image)
	{
		const std::array<double, 3> geometry = {image->resolution, image->origin_x, image->origin_y};
		fingerprint = fingerprint_of(geometry.data(), sizeof geometry);
	}
	for (const std::string& part : files_of_map(file))
	{
		try
		{
			read_blocks(
			    part,
			    [&](const char* block, std::size_t count)
			    {
				    fingerprint = fingerprint_of(block, count, fingerprint);
				    return true;
			    });
		}
		catch (const std::runtime_error& error)
		{
			throw std::runtime_error(part + ": " + error.what());
		}
	}
	return fingerprint;
}

std::uint64_t fingerprint_of_map(const COccupancyGridMap2D& map)
{
	const std::array<double, 5> geometry = {
	    static_cast<double>(map.getSizeX()), static_cast<double>(map.getSizeY()),
	    static_cast<double>(map.getResolution()), static_cast<double>(map.getXMin()),
	    static_cast<double>(map.getYMin())};
	const auto& cells = map.getRawMap();
	return fingerprint_of(
	    cells.data(), cells.size() * sizeof cells.front(), fingerprint_of(geometry.data(), sizeof geometry));
}

COccupancyGridMap2D on_whole_cells(const COccupancyGridMap2D& map)
{
	COccupancyGridMap2D moved = map;
	const auto whole = [&](float origin)
	{ return static_cast<double>(map.getResolution() * std::round(origin / map.getResolution())); };
	set_origin(moved, whole(map.getXMin()), whole(map.getYMin()));
	return moved;
}
}  // namespace d2s1r
