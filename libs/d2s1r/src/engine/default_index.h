// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "base/index_file.h"
#include "coarse/searched_map.h"

namespace d2s1r
{
/// The index of the default method: the map as it is drawn and, if its walls are so thick that it may have been
/// smeared, the map with their surfaces deeper inside the walls, too. Only scans can tell which of the two is right.
/// The coarse search is less exact than they differ, so that it looks for candidates of both in the last one.
struct DefaultIndex
{
	RangeProfiles profiles;            //!< for the coarse search
	std::vector<MapReading> readings;  //!< at least one; the map as it is drawn comes first
	WallPatterns walls;                //!< of the map as it is drawn

	/// Returns the map for a search, which refers to the index and to the first two arguments. See SearchedMap.
	SearchedMap searched(const Prior& prior, const Parameters& parameters, std::size_t number = 0) const
	{
		return {profiles, readings, walls, prior, parameters, number};
	}
};

/// Reads an index that save() wrote.
DefaultIndex read_default_index(IndexReader& file);

/// Writes an index.
void save(const DefaultIndex& index, IndexWriter& file);

/// Returns about how much memory [byte] it takes to build the index, beside the grid.
double memory_of_default_index(const Grid& grid, const Parameters& parameters);

/// Builds the index of a map.
/// \param grid is given back part by part, so that building takes little more memory than the index
/// \throws std::invalid_argument if a sensor can stand nowhere
DefaultIndex make_default_index(Grid grid, const Parameters& parameters);
}  // namespace d2s1r
