// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/changed_map.h>
#include <d2s1r/lost_cells.h>
#include <d2s1r/map_io.h>
#include <d2s1r/map_limits.h>

#include <stdexcept>

#include "base/file_text.h"
#include "map/cell_classes.h"
#include "map_files/foreign_map.h"
#include "map_files/map_image.h"

namespace d2s1r
{
namespace
{
OccupancyMap load_any(
    const std::string& file, const GridParameters& parameters, const std::optional<ImageGeometry>& image,
    MapChange change)
{
	check_readable(file);
	if (is_yaml_name(file)) return load_yaml_map(file, change);
	if (is_image_name(file))
	{
		if (!image)
			throw std::runtime_error(
			    "an image needs its resolution in m / pixel; give it, or write a map_server yaml for the image");
		PixelRule rule = plain_image_rule();
		if (change == MapChange::kNegated)
			rule.p_occupied = [as_it_is = rule.p_occupied](double brightness) { return as_it_is(1 - brightness); };
		return load_image_map(file, *image, rule);
	}
	return read_foreign_map(file, parameters);
}

std::string how_to_free_cells(const std::string& file, MapChange change, const GridParameters& parameters)
{
	const LostCells lost = change == MapChange::kNone ? lost_cells(file, parameters) : LostCells();
	if (lost.free_made_unknown > 0)
		return "its light greys lie above free_thresh and are unknown: set mode to scale, or raise free_thresh";
	if (lost.beyond_raw > 0)
		return "its mode: raw reads pixels from 101 to 254 as unknown cells: set mode to trinary or scale";
	return "check the map, grid.free_threshold and negate";
}
}  // namespace

std::shared_ptr<const OccupancyMap> load_changed_map(
    const std::string& file, MapChange change, const GridParameters& parameters,
    const std::optional<ImageGeometry>& image)
{
	OccupancyMap map;
	try
	{
		map = load_any(file, parameters, image, change);
		check_map_origin(static_cast<double>(map.origin_x), static_cast<double>(map.origin_y));
	}
	catch (const std::bad_alloc&)
	{
		const bool is_checked = is_yaml_name(file) || is_image_name(file);  // that it holds what its header says
		throw std::runtime_error(
		    file + ": takes more memory than there is" +
		    (is_checked ? "; use a coarser or smaller map, or end other programs"
		                : ", or is damaged; use a coarser map, or save it again"));
	}
	catch (const std::exception& error)
	{
		throw std::runtime_error(file + ": " + error.what());
	}
	if (!has_free_cell(map, CellClasses(parameters)))
		throw std::runtime_error(file + ": has no free cell; " + how_to_free_cells(file, change, parameters));
	return std::make_shared<const OccupancyMap>(std::move(map));
}

std::shared_ptr<const OccupancyMap> load_map(
    const std::string& file, const GridParameters& parameters, const std::optional<ImageGeometry>& image)
{
	return load_changed_map(file, MapChange::kNone, parameters, image);
}
}  // namespace d2s1r
