// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/map_io.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "base/file_text.h"
#include "base/index_file.h"
#include "map_files/map_image.h"

namespace d2s1r
{
namespace
{
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

std::uint64_t fingerprint_of_map(const OccupancyMap& map)
{
	const std::array<double, 5> geometry = {
	    static_cast<double>(map.width), static_cast<double>(map.height), static_cast<double>(map.cell_size),
	    static_cast<double>(map.origin_x), static_cast<double>(map.origin_y)};
	return fingerprint_of(map.cells.data(), map.cells.size(), fingerprint_of(geometry.data(), sizeof geometry));
}
}  // namespace d2s1r
