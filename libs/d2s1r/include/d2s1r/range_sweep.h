// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <functional>

namespace d2s1r
{
/// Fixed-point distance of the sweep: 1 unit = cell_size / kRangeUnitsPerCell.
inline constexpr int kRangeUnitsPerCell = 16;

/// Called once a direction, with the ranges from cells[0], cells[1], ... in units of cell_size / kRangeUnitsPerCell,
/// 65535 where there is no obstacle within range. The pointers are valid during the call only.
using RangeSink =
    std::function<void(int direction, const std::uint16_t* to_occupied, const std::uint16_t* to_unknown_or_occupied)>;

/// Ranges from the centre of every cell in `cells` along `directions` equally spaced directions (direction i points at
/// 2 pi i / directions, counter-clockwise from x), one sweep over the grid a direction: the distance to the last
/// obstacle is carried along digital lines.
/// \param cells increasing
/// \param max_range [m]
void sweep_ranges(
    const Grid& grid, const std::vector<CellIndex>& cells, int directions, double max_range, const RangeSink& sink);
}  // namespace d2s1r
