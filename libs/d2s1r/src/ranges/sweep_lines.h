// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace d2s1r
{
/// [-] Distances of the sweep are whole numbers of cell_size / kRangeUnitsPerCell.
inline constexpr int kRangeUnitsPerCell = 16;

/// [-] Digital lines that cross a cell: its centre is at most half a phase, a 64th of a cell, off one of them.
inline constexpr int kPhases = 32;

/// A direction as a sweep sees it: rays run along the axis they are closer to, `slope` rows a column.
struct SweepDirection
{
	bool along_x;    //!< whether rays run along x, not along y
	bool backwards;  //!< whether rays run towards lower columns
	double slope;    //!< [rows / column] in the sense of the ray, in [-1, 1]

	explicit SweepDirection(double angle)
	{
		const double dx = std::cos(angle), dy = std::sin(angle);
		along_x = std::abs(dx) >= std::abs(dy);
		const double along = along_x ? dx : dy, across = along_x ? dy : dx;
		backwards = along < 0;
		slope = across / std::abs(along);
	}
};

/// Where the lines cross one column. Lines that enter a cell by the column's near edge all do so at the same distance;
/// those that enter it from the cell beside it come next, at distances that grow from line to line.
struct ColumnCrossing
{
	std::ptrdiff_t near_line;        //!< first of kPhases lines that enter row 0 by the near edge
	std::ptrdiff_t side_line;        //!< first line that enters row 0 from the side
	std::size_t side_lines;          //!< number of these, at most kPhases
	std::ptrdiff_t center_line;      //!< the line nearest to the centre of row 0's cell
	std::uint16_t center_at;         //!< [units] of the column's centre, along the axis, modulo 2^16
	std::uint16_t near_at;           //!< [units] of the near edge
	std::uint16_t side_at[kPhases];  //!< [units] where side_line, side_line + 1, ... enter row 0
};

/// The lines y = slope * column + line / kPhases, up to an offset of the lines. Row r, seen from its lower edge, is
/// kPhases * r lines above row 0. Columns are counted in the sense of the ray.
class LineFamily
{
   public:
	/// Makes the lines that cross a grid. \param slope [rows / column]
	LineFamily(double slope, int columns, int rows);

	std::size_t size() const { return size_; }

	ColumnCrossing crossing(int column) const;

   private:
	std::ptrdiff_t near_line(int column) const;

	double slope_;          //!< [rows / column]
	std::ptrdiff_t first_;  //!< index of the line with offset 0
	std::size_t size_;      //!< lines that cross the grid
};

struct Run
{
	std::int32_t row = 0;
	std::int32_t length = 0;
};

struct ColumnRuns
{
	std::vector<Run> runs;                  //!< by column, then by row
	std::vector<std::size_t> first;         //!< by column, its first run; one more at the end
	std::vector<std::size_t> cells_before;  //!< by column, sum of the lengths before its first run; one more at the end
};

/// All that sweeps along one axis have to know of a map. Columns run across that axis: they are the grid's columns for
/// sweeps along x, the grid's rows for sweeps along y. A margin of one unknown cell surrounds the grid, so that cell
/// (0, 0) of the grid is row 1 of column 1.
struct SweepLines
{
	int columns = 0;
	int rows = 0;
	ColumnRuns occupied;  //!< occupied cells that rays can enter
	ColumnRuns cells;     //!< where ranges are wanted
};

/// The lines along both axes, which a full circle of directions needs.
struct SweepLayout
{
	SweepLines along_x;
	SweepLines along_y;
};

struct PlacedCells
{
	ColumnRuns runs;
	std::vector<std::int32_t> ranks;  //!< by cell, in the order in which they were given, its place among the runs
};

/// Finds the obstacles along both axes of a grid; no ranges are wanted yet.
SweepLayout find_obstacles(const Grid& grid);

/// Places `cells`, which are in any order, along x or y. \param grid needs no cells
PlacedCells place_cells(const std::vector<CellIndex>& cells, const Grid& grid, bool along_x);
}  // namespace d2s1r
