// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sweep_lines.h"

#include <cmath>

namespace d2s1r
{
/// Room for whole vectors behind the last range.
inline constexpr std::size_t kSweepPadding = 64;

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

/// Ranges from all `lines.cells`, in their order, to `obstacles` in one direction, in units of
/// cell_size / kRangeUnitsPerCell; kNoObstacle above `max_units`.
/// \param ranges has room for kSweepPadding more
void sweep(
    const SweepLines& lines, const ColumnRuns& obstacles, const SweepDirection& direction, int max_units,
    std::uint16_t* ranges);
}  // namespace d2s1r
