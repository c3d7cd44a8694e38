// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <vector>

namespace d2s1r
{
struct WallMeasure
{
	/// [m] Thickness that three of ten pieces of wall do not exceed, among those with free space on both sides; 0 if
	/// the map has no such wall. A laser draws partitions, doors and furniture one or two cells thick, so that a map in
	/// which even the thin walls are thick was smeared: by errors of its poses, by blurring, or by safety margins.
	double thickness = 0;

	/// [m] How deep inside the drawn walls the surfaces lie that a laser sees, if the map was smeared; 0 if it is
	/// sharp.
	double surface_depth = 0;

	/// Returns how far [m] from there the surfaces may lie, because maps are not smeared evenly.
	double surface_tolerance() const { return 0.35 * surface_depth; }
};

/// Measures the walls of `grid`. Thread-safe, as the following function is.
WallMeasure measure_walls(const Grid& grid);

/// Returns the measures of the map that `grid` was made of.
MapMeasure measure_map(const Grid& grid);

/// Returns the occupied cells of furniture: pieces of the drawn walls less than 1 m long and wide, more than 0.1 m from
/// all others, and beside no unknown cell, as parts of walls are that were seen from one side. The legs of chairs and
/// tables, bags and posts are moved, or seen in one scan and missed in the next.
std::vector<CellIndex> find_furniture(const Grid& grid);

/// Returns `grid` with walls whose surfaces lie `depth` [m] deeper: occupied cells that are less than that behind the
/// nearest free cell become free, but the middle line of a wall stays.
Grid with_surfaces_deeper(const Grid& grid, double depth);
}  // namespace d2s1r
