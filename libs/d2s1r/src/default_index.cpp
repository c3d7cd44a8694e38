// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "default_index.h"

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

/// \param tolerance [m] of the walls: see DistanceField
MapReading make_reading(Grid grid, const std::vector<CellIndex>& furniture, double tolerance)
{
	const Grid surfaces = with_wall_surfaces_only(std::move(grid));
	BeamTracer tracer(surfaces, furniture);  // first, because making it takes more memory than making the field
	return {DistanceField(surfaces, tolerance), std::move(tracer)};
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
	Grid deeper = is_smeared ? with_surfaces_deeper(grid, walls.surface_depth) : Grid();
	const Grid& searched = is_smeared ? deeper : grid;
	index.profiles = make_range_profiles(
	    searched, find_sensor_cells(searched, parameters.free_cells), parameters.coarse_search.spacing);
	index.readings.push_back(make_reading(std::move(grid), furniture, 0));
	if (is_smeared) index.readings.push_back(make_reading(std::move(deeper), furniture, walls.surface_tolerance()));
	return index;
}

void save(const DefaultIndex& index, IndexWriter& file)
{
	RangeProfiles::fields(index.profiles, file);
	file(index.readings.size());
	for (const MapReading& reading : index.readings) MapReading::fields(reading, file);
}

DefaultIndex read_default_index(IndexReader& file)
{
	DefaultIndex index;
	RangeProfiles::fields(index.profiles, file);
	std::size_t readings = 0;
	file(readings);
	for (std::size_t i = 0; i < readings; i++)
	{
		index.readings.emplace_back();
		MapReading::fields(index.readings.back(), file);
	}
	return index;
}
}  // namespace d2s1r
