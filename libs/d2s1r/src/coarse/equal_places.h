// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPose2D.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/array.h"
#include "ranges/skip_distances.h"
#include "scan/beam_subset.h"

namespace d2s1r
{
struct SearchedMap;

/// Which of the 5 x 5 cells around a cell are occupied, one bit each: by row from below, then by column.
using WallPattern = std::uint32_t;

/// Returns what surrounds a cell of the map as it is drawn; beyond the margin nothing is occupied.
WallPattern pattern_at(const SkipMap& map, int column, int row);

/// Returns a pattern that is turned by a quarter turn, counter-clockwise.
WallPattern turned(WallPattern pattern);

/// Lists the cells at the surfaces of the walls of a map by their patterns, so that those which look alike are found at
/// once. Turns by quarter turns count as one pattern. It needs four bytes a cell, and eight a pattern.
struct WallPatterns
{
	Array<WallPattern> patterns;         //!< increasing; of the four turns of each the least
	Array<std::uint32_t> first_of_each;  //!< by pattern, its first one of `cells`; one more at the end
	Array<std::uint32_t> cells;          //!< positions in SkipMap::cells

	/// Some of `cells`.
	struct Cells
	{
		const std::uint32_t* first = nullptr;
		std::size_t count = 0;  //!< [-]

		const std::uint32_t* begin() const { return first; }
		const std::uint32_t* end() const { return first + count; }
	};

	/// Returns the cells that look like `pattern`, in any turn; none for one that the map does not show.
	Cells cells_like(WallPattern pattern) const;

	/// Lists what an index file holds of the patterns.
	template <class Self, class File>
	static void fields(Self& self, File& file)
	{
		file(self.patterns);
		file(self.first_of_each);
		file(self.cells);
	}
};

/// Lists the cells of a map.
WallPatterns find_wall_patterns(const SkipMap& map);

/// A pose of the sensor from which a map looks as from another one.
struct EqualPlace
{
	mrpt::math::TPose2D pose;  //!< sensor in map, m and rad
	const SearchedMap* map;    //!< that the pose is in
};

/// Finds the places that equal, cell for cell, the one where the sensor is thought to be, turned by any number of
/// quarter turns, in all maps whose cells have the same size. Nothing is searched: from the walls that the scan shows
/// the rarest patterns are taken, and where a map has the same one, the others are looked up. Thread-safe.
/// \param beams of the scan
/// \param sensor in map, m and rad
/// \param map number of the map it is in
/// \return some places, in no order, where all walls stand that the scan shows; some twenty at most
std::vector<EqualPlace> equal_places(
    const BeamSubset& beams, const std::vector<SearchedMap>& maps, const mrpt::math::TPose2D& sensor, std::size_t map);
}  // namespace d2s1r
