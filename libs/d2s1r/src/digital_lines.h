// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/range_sweep.h>

#include <cmath>
#include <cstddef>

namespace d2s1r
{
/// Digital lines a cell is crossed by: its centre is at most half a phase, a 64th of a cell, off one of them.
inline constexpr int kPhases = 32;

/// A direction as a sweep sees it: rays run along the axis they are closer to, `slope` rows a column.
struct SweepDirection
{
	bool along_x;    //!< else along y
	bool backwards;  //!< towards lower columns
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

/// How the lines cross one column. Lines that enter a cell by the column's near edge all do so at the same distance;
/// those that enter it from the cell beside it come next, at distances that grow from line to line.
struct ColumnCrossing
{
	std::ptrdiff_t near_line;        //!< first of kPhases lines that enter row 0 by the near edge
	std::ptrdiff_t side_line;        //!< first line that enters row 0 from the side
	std::size_t side_lines;          //!< how many do, at most kPhases
	std::ptrdiff_t center_line;      //!< the line nearest to the centre of row 0's cell
	std::uint16_t center_at;         //!< [units] of the column's centre, along the axis, modulo 2^16
	std::uint16_t near_at;           //!< of the near edge
	std::uint16_t side_at[kPhases];  //!< where side_line, side_line + 1, ... enter row 0
};

/// The lines y = slope * column + line / kPhases, up to an offset of the lines. Row r, seen from its lower edge, is
/// kPhases * r lines above row 0. Columns are counted in the sense of the ray.
class LineFamily
{
   public:
	LineFamily(double slope, int columns, int rows);

	std::size_t size() const { return size_; }
	ColumnCrossing crossing(int column) const;

   private:
	std::ptrdiff_t near_line(int column) const;

	double slope_;          //!< [rows / column]
	std::ptrdiff_t first_;  //!< index of the line with offset 0
	std::size_t size_;      //!< lines that cross the grid
};
}  // namespace d2s1r
