// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "engine/default_index.h"

#include <algorithm>
#include <cmath>
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

/// Returns about how many cells find_wall_patterns() lists: those that with_wall_surfaces_only() leaves.
double count_walls(const Grid& grid)
{
	const int depth = std::max(1, static_cast<int>(std::lround(kWallThickness / grid.cell_size)));  // [cells]
	const auto is_occupied = [&](int column, int row)
	{ return grid.contains(column, row) && grid.at(column, row) == Cell::kOccupied; };
	double walls = 0;
	for (int row = 0; row < grid.height; row++)
		for (int column = 0; column < grid.width; column++)
			if (is_occupied(column, row) && !(is_occupied(column - depth, row) && is_occupied(column + depth, row) &&
			                                  is_occupied(column, row - depth) && is_occupied(column, row + depth)))
				walls++;
	return walls;
}
}  // namespace

double memory_of_default_index(const Grid& grid, const Parameters& parameters)
{
	// All in bytes. First the free cells are listed, then ranges are swept, then the fields are made, at last walls are
	// listed.
	constexpr double kListed = 6, kListedByRegion = 15, kSwept = 40, kPosition = 4, kGroup = 4, kWall = 20;
	const double listed = parameters.free_cells.largest_region_only ? kListedByRegion : kListed;
	const int side = std::max(1, static_cast<int>(std::lround(parameters.coarse_search.spacing / grid.cell_size)));
	const auto cells = static_cast<double>(grid.cells.size());
	const int readings = may_be_smeared(measure_walls(grid), grid) ? 2 : 1;
	const double positions = count_free_squares(grid, side);
	const double profiles =
	    (RangeProfiles::kDirections / 2 + kPosition) * positions +
	    (static_cast<double>(in_whole_lines(RangeProfiles::kDirections)) + RangeProfiles::kBins + kGroup) *
	        count_free_squares(grid, 2 * side);
	const double walls = kWall * count_walls(grid);
	return std::max(listed * cells, cells + profiles + std::max(kSwept * positions, readings * cells + walls));
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
	grid = {};
	auto cells = find_sensor_cells(searched, parameters.free_cells);
	index.profiles = make_range_profiles(std::move(searched), std::move(cells), parameters.coarse_search.spacing);
	index.readings.push_back({DistanceField(map, 0, 0), BeamTracer(map, 0)});
	if (is_smeared) index.readings.push_back({DistanceField(map, 1, walls.surface_tolerance()), BeamTracer(map, 1)});
	index.walls = find_wall_patterns(map);
	return index;
}

void save(const DefaultIndex& index, IndexWriter& file)
{
	RangeProfiles::fields(index.profiles, file);
	SkipMap::fields(index.readings.front().tracer.map(), file);
	file(index.readings.size());
	for (const MapReading& reading : index.readings) DistanceField::fields(reading.field, file);
	WallPatterns::fields(index.walls, file);
}

DefaultIndex read_default_index(IndexReader& file)
{
	DefaultIndex index;
	SkipMap map;
	RangeProfiles::fields(index.profiles, file);
	SkipMap::fields(map, file);
	std::size_t readings = 0;
	file(readings);
	if (readings < 1 || readings > 2) file.refuse_content();
	for (std::size_t i = 0; i < readings; i++)
	{
		index.readings.push_back({DistanceField(), BeamTracer(map, static_cast<int>(i))});
		DistanceField::fields(index.readings.back().field, file);
	}
	WallPatterns::fields(index.walls, file);
	return index;
}
}  // namespace d2s1r
