// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

namespace d2s1r
{
/// Consecutive rows of one column.
struct Run
{
	std::int32_t row = 0;
	std::int32_t length = 0;
};

/// Runs of rows, column by column.
struct ColumnRuns
{
	std::vector<Run> runs;                  //!< by column, then by row
	std::vector<std::size_t> first;         //!< of runs, by column; one more at the end
	std::vector<std::size_t> cells_before;  //!< sum of the lengths before runs[first[column]]; one more at the end
};

/// What sweeps along one axis have to know of a map. Columns run across that axis: they are the grid's columns for
/// sweeps along x, the grid's rows for sweeps along y. A margin of one unknown cell surrounds the grid, so that cell
/// (0, 0) of the grid is row 1 of column 1.
struct SweepLines
{
	int columns = 0;
	int rows = 0;
	ColumnRuns occupied;             //!< occupied cells that rays can enter
	ColumnRuns unknown_or_occupied;  //!< not-free cells that rays from free cells can enter
	ColumnRuns cells;                //!< where ranges are wanted
};

/// Both are needed for a full circle of directions.
struct SweepLayout
{
	SweepLines along_x;
	SweepLines along_y;
};

/// \param cells in any order
SweepLayout make_sweep_layout(const Grid& grid, const std::vector<CellIndex>& cells);

/// Places of `cells`, in any order, among those of the lines along x or y.
std::vector<std::int32_t> ranks_of(const std::vector<CellIndex>& cells, const Grid& grid, bool along_x);
}  // namespace d2s1r
