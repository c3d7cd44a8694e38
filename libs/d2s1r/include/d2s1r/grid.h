// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/occupancy_map.h>
#include <d2s1r/parameters.h>

#include <cstdint>
#include <vector>

namespace d2s1r
{
/// Says how small [m] the cells of a map may be: distances to walls are kept up to 32 cells.
inline constexpr double kLeastCellSize = 0.0063;

/// Says what is known of a cell.
enum class Cell : std::uint8_t
{
	kFree,
	kOccupied,
	kUnknown
};

/// Numbers a cell by its position in Grid::cells.
using CellIndex = std::int32_t;

/// Holds an occupancy map that is reduced to three classes and to the bounding box of what is known.
struct Grid
{
	int width = 0;            //!< [cells] along x
	int height = 0;           //!< [cells] along y
	double cell_size = 0;     //!< [m]
	double origin_x = 0;      //!< [m] map frame, lower left corner of cell (0, 0)
	double origin_y = 0;      //!< [m] map frame
	std::vector<Cell> cells;  //!< row-major, the row of least y first

	/// Returns the position of a cell in `cells`.
	CellIndex index(int column, int row) const { return row * width + column; }

	/// Returns whether there is a cell at this column and row.
	bool contains(int column, int row) const { return column >= 0 && row >= 0 && column < width && row < height; }

	/// Returns the class of a cell of the grid.
	Cell at(int column, int row) const { return cells[static_cast<std::size_t>(index(column, row))]; }

	/// Returns the x coordinate [m] of the centre of a cell, map frame.
	double center_x(CellIndex cell) const { return origin_x + (cell % width + 0.5) * cell_size; }

	/// Returns the y coordinate [m] of the centre of a cell, map frame.
	double center_y(CellIndex cell) const
	{
		const int row = cell / width;
		return origin_y + (row + 0.5) * cell_size;
	}
};

/// Measures of a map that tell how well scans can be found in it. Localizer::measure() returns them.
struct MapMeasure
{
	double free_area = 0;  //!< [m^2] of free cells
	double wall_area = 0;  //!< [m^2] of occupied cells; without any, no scan can be found

	/// [m] Thickness that three of ten pieces of wall do not exceed, among those with free space on both sides; 0 if
	/// there are too few of them. A laser draws partitions, doors and furniture one or two cells thick.
	double wall_thickness = 0;

	/// [m] How deep inside the drawn walls their true surfaces may lie, if even the thin walls are thick; 0 if the map
	/// is sharp. If it is more than half a cell, the default method reads the map in both ways.
	double surface_depth = 0;

	/// [0, 1] Share of the border of free space where no wall is: it meets unknown cells or the end of the map.
	double open_border = 0;
};

/// Classifies the cells of `map` and crops them to the bounding box of the known ones. Thread-safe.
/// \throws std::invalid_argument if thresholds cross, there is no known cell, cells are below 6.3 mm, more than
///         can be numbered or not width times height, or the map is further than 100 km from the origin of its frame
Grid make_grid(const OccupancyMap& map, const GridParameters& parameters);

inline constexpr double kWallThickness = 0.1;  //!< [m] of walls that are drawn by a laser whose poses are known

/// Returns the grid as a laser would have mapped it: what is occupied deeper than this (at least a cell) below the
/// surface of a wall becomes unknown, for no beam ever ends there. The surface is where free or unknown space begins:
/// the edges of drawn plans are blurred, and their greys are unknown.
Grid with_wall_surfaces_only(Grid grid);
}  // namespace d2s1r
