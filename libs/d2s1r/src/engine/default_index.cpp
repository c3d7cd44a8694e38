// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "engine/default_index.h"

#include <stdexcept>
#include <utility>

#include "map/free_cells.h"
#include "ranges/wall_surface.h"

namespace d2s1r
{
namespace
{
/// Returns whether with_surfaces_deeper() takes anything off: cells are half a cell deep and more.
bool may_be_smeared(const WallMeasure& walls, const Grid& grid)
{
	return walls.surface_depth > 0.5 * grid.cell_size;
}
}  // namespace

int count_readings(const Grid& grid)
{
	return may_be_smeared(measure_walls(grid), grid) ? 2 : 1;
}

DefaultIndex make_default_index(Grid grid, const Parameters& parameters)
{
	DefaultIndex index;
	const WallMeasure walls = measure_walls(grid);
	const bool is_smeared = may_be_smeared(walls, grid);
	const std::vector<CellIndex> furniture = find_furniture(grid);  // as drawn: deeper surfaces make pieces of walls
	Grid searched = with_wall_surfaces_only(is_smeared ? with_surfaces_deeper(grid, walls.surface_depth) : grid);
	const SkipMap map = is_smeared ? make_skip_map(with_wall_surfaces_only(std::move(grid)), searched, furniture)
	                               : make_skip_map(searched, furniture);
	std::vector<Cell>().swap(grid.cells);
	auto cells = find_sensor_cells(searched, parameters.free_cells);
	index.profiles = make_range_profiles(std::move(searched), std::move(cells), parameters.coarse_search.spacing);
	index.readings.push_back({DistanceField(map, 0, 0), BeamTracer(map, 0)});
	if (is_smeared) index.readings.push_back({DistanceField(map, 1, walls.surface_tolerance()), BeamTracer(map, 1)});
	return index;
}

void save(const DefaultIndex& index, IndexWriter& file)
{
	RangeProfiles::fields(index.profiles, file);
	SkipMap::fields(index.readings.front().tracer.map(), file);
	file(index.readings.size());
	for (const MapReading& reading : index.readings) DistanceField::fields(reading.field, file);
}

DefaultIndex read_default_index(IndexReader& file)
{
	DefaultIndex index;
	SkipMap map;
	RangeProfiles::fields(index.profiles, file);
	SkipMap::fields(map, file);
	std::size_t readings = 0;
	file(readings);
	if (readings < 1 || readings > 2)
		throw std::runtime_error("an index has one or two readings of its map; make it anew");
	for (std::size_t i = 0; i < readings; i++)
	{
		index.readings.push_back({DistanceField(), BeamTracer(map, static_cast<int>(i))});
		DistanceField::fields(index.readings.back().field, file);
	}
	return index;
}
}  // namespace d2s1r
