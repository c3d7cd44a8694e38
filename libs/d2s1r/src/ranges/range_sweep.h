// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "ranges/sweep_lines.h"

namespace d2s1r
{
/// The farthest that the sweep can look: its distances have 16 bits.
inline constexpr int kMostSweptCells = 4000;

/// What the sweep reports where there is no obstacle within range.
inline constexpr std::uint16_t kNoObstacle = 65535;

/// Ranges in one direction, in units of cell_size / kRangeUnitsPerCell; kNoObstacle where there is no obstacle within
/// range.
struct SweptRanges
{
	const std::uint16_t* in_sweep_order = nullptr;
	const std::int32_t* ranks = nullptr;  //!< places of the cells in that order

	/// From cells[i].
	std::uint16_t operator[](std::size_t i) const { return in_sweep_order[ranks[i]]; }
};

/// Called once per direction, in the thread of sweep_ranges(). The ranges are valid during the call only.
using RangeSink = std::function<void(int direction, const SweptRanges& ranges)>;

/// Ranges from the centre of every cell in `cells` along `directions` equally spaced directions (direction i points at
/// 2 pi i / directions, counter-clockwise from x), one sweep over the grid per direction: the last obstacle seen is
/// carried along digital lines. What lies outside of the grid is unknown. 99 % of the ranges are within a cell of
/// RayCaster's exact ones: test_site_rays.cpp checks that on real maps.
/// \param cells free ones, in any order
/// \param max_range [m] at most kMostSweptCells cells
/// \param stop_at_unknown rays end at unknown cells, too
/// \throws std::invalid_argument if max_range is above that
void sweep_ranges(
    const Grid& grid, const std::vector<CellIndex>& cells, int directions, double max_range, bool stop_at_unknown,
    const RangeSink& sink);

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
