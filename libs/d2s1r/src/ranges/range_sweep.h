// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "ranges/sweep_lines.h"

namespace d2s1r
{
/// [cells] How far the sweep can look: its distances have 16 bits.
inline constexpr int kMostSweptCells = 4000;

/// The range that the sweep reports where there is no obstacle within range.
inline constexpr std::uint16_t kNoObstacle = 65535;

/// The ranges of all cells in one direction, in units of cell_size / kRangeUnitsPerCell; kNoObstacle where there is no
/// obstacle within range.
struct SweptRanges
{
	const std::uint16_t* in_sweep_order = nullptr;
	const std::int32_t* ranks = nullptr;  //!< by cell, its place in that order

	/// Returns the range from cells[i].
	std::uint16_t operator[](std::size_t i) const { return in_sweep_order[ranks[i]]; }
};

/// Takes the ranges of one direction. It is called once per direction, in the thread of the sweep; the ranges are
/// valid during the call only.
using RangeSink = std::function<void(int direction, const SweptRanges& ranges)>;

/// Sweeps over a map, whose obstacles it keeps. One sweep per direction carries the last obstacle seen along digital
/// lines. What lies outside of the grid is unknown. 99 % of the ranges are within a cell of RayCaster's exact ones:
/// test_site_rays.cpp checks that on real maps. One thread at a time uses it.
class RangeSweep
{
   public:
	explicit RangeSweep(const Grid& grid);

	/// Finds the ranges from the centre of every cell in `cells` along `directions` equally spaced directions
	/// (direction i points at 2 pi i / directions, counter-clockwise from x). It takes some 40 bytes a cell.
	/// \param cells free cells, in any order
	/// \param max_range [m] at most kMostSweptCells cells
	/// \throws std::invalid_argument if max_range is above that
	void operator()(const std::vector<CellIndex>& cells, int directions, double max_range, const RangeSink& sink);

   private:
	Grid grid_;  //!< without its cells
	SweepLayout layout_;
};

/// Returns `max_range` [m] in units of cell_size / kRangeUnitsPerCell.
/// \throws std::invalid_argument if 16 bits of distance cannot hold it
int max_range_units(const Grid& grid, double max_range);

/// Finds the ranges from all `lines.cells`, in their order, to `lines.occupied` in one direction, in units of
/// cell_size / kRangeUnitsPerCell; they are kNoObstacle above `max_units`. Every kind of SIMD gives the same result.
/// \param hits memory that is kept from call to call
/// \param ranges room for as many as there are lines.cells
void sweep(
    const SweepLines& lines, const SweepDirection& direction, int max_units, std::vector<std::uint16_t>& hits,
    std::uint16_t* ranges);
}  // namespace d2s1r
