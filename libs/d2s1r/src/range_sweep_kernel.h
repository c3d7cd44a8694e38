// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "column_runs.h"
#include "digital_lines.h"

namespace d2s1r
{
/// `max_range` [m] in units of cell_size / kRangeUnitsPerCell.
/// \throws std::invalid_argument if 16 bits of distance cannot hold it
int max_range_units(const Grid& grid, double max_range);

/// Ranges from all `lines.cells`, in their order, to `obstacles` in one direction, in units of
/// cell_size / kRangeUnitsPerCell; kNoObstacle above `max_units`. Same result whatever SIMD the machine has.
/// \param hits scratch
/// \param ranges as many as there are lines.cells
void sweep(
    const SweepLines& lines, const ColumnRuns& obstacles, const SweepDirection& direction, int max_units,
    std::vector<std::uint16_t>& hits, std::uint16_t* ranges);
}  // namespace d2s1r
