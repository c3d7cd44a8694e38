// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

namespace d2s1r
{
/// Cells of `grid` a sensor can stand in (the passable grids of Algorithm 1), in increasing order; may be empty.
/// Thread-safe.
std::vector<CellIndex> find_free_cells(const Grid& grid, const FreeCellParameters& parameters);
}  // namespace d2s1r
