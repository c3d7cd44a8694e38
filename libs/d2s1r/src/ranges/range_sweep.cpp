// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ranges/range_sweep.h"

#include "base/simd.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ranges/range_sweep.cpp"  // of the include path src/
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace d2s1r
{
namespace HWY_NAMESPACE
{
namespace hn = hwy::HWY_NAMESPACE;
const hn::CappedTag<std::uint16_t, kPhases> kLanes;

struct Runs
{
	const Run* begin_;
	const Run* end_;
	Runs(const ColumnRuns& runs, int column)
	    : begin_(runs.runs.data() + runs.first[static_cast<std::size_t>(column)]),
	      end_(runs.runs.data() + runs.first[static_cast<std::size_t>(column) + 1])
	{
	}
	const Run* begin() const { return begin_; }
	const Run* end() const { return end_; }
};

/// Marks the lines that enter obstacles from the side. Only the first cell of a run can be entered so; the others lie
/// behind it.
void mark_sides(const Runs& obstacles, const ColumnCrossing& crossing, bool climbs, std::uint16_t* hits)
{
	for (const Run& run : obstacles)
	{
		const int row = climbs ? run.row : run.row + run.length - 1;
		std::uint16_t* line = hits + crossing.side_line + static_cast<std::ptrdiff_t>(row) * kPhases;
		for (std::size_t i = 0; i < crossing.side_lines; i += hn::Lanes(kLanes))
			hn::BlendedStore(
			    hn::LoadU(kLanes, crossing.side_at + i), hn::FirstN(kLanes, crossing.side_lines - i), kLanes, line + i);
	}
}

/// Marks the lines that enter obstacles by the near edge of the column.
void mark_near_edges(const Runs& obstacles, const ColumnCrossing& crossing, std::uint16_t* hits)
{
	const auto at = hn::Set(kLanes, crossing.near_at);
	for (const Run& run : obstacles)
	{
		std::uint16_t* line = hits + crossing.near_line + static_cast<std::ptrdiff_t>(run.row) * kPhases;
		std::uint16_t* const end = line + static_cast<std::ptrdiff_t>(run.length) * kPhases;
		for (; line != end; line += hn::Lanes(kLanes)) hn::StoreU(at, kLanes, line);
	}
}

/// Writes the distances along the axis from the centres of cells to the last obstacles on their lines.
void emit(const Runs& cells, const ColumnCrossing& crossing, const std::uint16_t* hits, std::uint16_t* ranges)
{
	for (const Run& run : cells)
	{
		const std::uint16_t* line = hits + crossing.center_line + static_cast<std::ptrdiff_t>(run.row) * kPhases;
		for (int i = 0; i < run.length; i++, line += kPhases)
			*ranges++ = static_cast<std::uint16_t>(*line - crossing.center_at);
	}
}

/// Turns distances along the axis into distances along the lines, which are `stretch` / 2^16 + 1 times as long.
void lengthen(std::uint16_t stretch, std::uint16_t max_units, std::size_t size, std::uint16_t* ranges)
{
	const auto factor = hn::Set(kLanes, stretch), most = hn::Set(kLanes, max_units),
	           none = hn::Set(kLanes, kNoObstacle);
	std::size_t i = 0;
	for (; i + hn::Lanes(kLanes) <= size; i += hn::Lanes(kLanes))
	{
		const auto along = hn::LoadU(kLanes, ranges + i);
		const auto range = hn::SaturatedAdd(along, hn::MulHigh(along, factor));
		hn::StoreU(hn::IfThenElse(hn::Gt(range, most), none, range), kLanes, ranges + i);
	}
	for (; i < size; i++)
	{
		const std::uint32_t range = ranges[i] + ((static_cast<std::uint32_t>(ranges[i]) * stretch) >> 16U);
		ranges[i] = range > max_units ? kNoObstacle : static_cast<std::uint16_t>(range);
	}
}

/// Moves obstacles beyond the horizon to it, before their distance overflows.
void forget(std::uint16_t here, int horizon, std::vector<std::uint16_t>& hits)
{
	for (auto& hit : hits)
		if (static_cast<std::uint16_t>(hit - here) > horizon) hit = static_cast<std::uint16_t>(here + horizon);
}

/// Sweeps all columns in one direction: the inner loop of sweep().
void sweep_columns(
    const SweepLines& lines, const SweepDirection& direction, int max_units, std::vector<std::uint16_t>& hits,
    std::uint16_t* ranges)
{
	const LineFamily family(direction.slope, lines.columns, lines.rows);
	const int horizon = max_units + 1, columns_to_overflow = (65535 - horizon) / kRangeUnitsPerCell - 2;
	int last_forgotten = lines.columns;
	hits.assign(family.size(), static_cast<std::uint16_t>(lines.columns * kRangeUnitsPerCell + horizon));
	for (int column = lines.columns - 1; column >= 0; column--)
	{
		const int grid_column = direction.backwards ? lines.columns - 1 - column : column;
		const Runs walls(lines.occupied, grid_column), cells(lines.cells, grid_column);
		if (last_forgotten - column >= columns_to_overflow)
		{
			forget(static_cast<std::uint16_t>(column * kRangeUnitsPerCell), horizon, hits);
			last_forgotten = column;
		}
		if (walls.begin() == walls.end() && cells.begin() == cells.end()) continue;
		const ColumnCrossing crossing = family.crossing(column);
		mark_sides(walls, crossing, direction.slope > 0, hits.data());
		emit(cells, crossing, hits.data(), ranges + lines.cells.cells_before[static_cast<std::size_t>(grid_column)]);
		mark_near_edges(walls, crossing, hits.data());
	}
	const auto stretch = static_cast<std::uint16_t>(std::lround((std::hypot(1, direction.slope) - 1) * 65536));
	lengthen(stretch, static_cast<std::uint16_t>(max_units), lines.cells.cells_before.back(), ranges);
}
}  // namespace HWY_NAMESPACE
}  // namespace d2s1r
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace d2s1r
{
HWY_EXPORT(sweep_columns);

int max_range_units(const Grid& grid, double max_range)
{
	if (max_range / grid.cell_size > kMostSweptCells)
		throw std::invalid_argument("RangeSweep: max_range is above 4000 cells");
	return static_cast<int>(max_range / grid.cell_size * kRangeUnitsPerCell);
}

void sweep(
    const SweepLines& lines, const SweepDirection& direction, int max_units, std::vector<std::uint16_t>& hits,
    std::uint16_t* ranges)
{
	HWY_DYNAMIC_DISPATCH(sweep_columns)(lines, direction, max_units, hits, ranges);
}

RangeSweep::RangeSweep(const Grid& grid)
    : grid_{grid.width, grid.height, grid.cell_size, grid.origin_x, grid.origin_y, {}}, layout_(find_obstacles(grid))
{
}

void RangeSweep::operator()(
    const std::vector<CellIndex>& cells, int directions, double max_range, const RangeSink& sink)
{
	const int limit = max_range_units(grid_, max_range);
	PlacedCells along_x = place_cells(cells, grid_, true), along_y = place_cells(cells, grid_, false);
	layout_.along_x.cells = std::move(along_x.runs);
	layout_.along_y.cells = std::move(along_y.runs);
	std::vector<std::uint16_t> ranges(cells.size()), hits;
	for (int i = 0; i < directions; i++)
	{
		const SweepDirection direction(2 * M_PI * i / directions);
		sweep(direction.along_x ? layout_.along_x : layout_.along_y, direction, limit, hits, ranges.data());
		sink(i, {ranges.data(), (direction.along_x ? along_x : along_y).ranks.data()});
	}
}
}  // namespace d2s1r
#endif  // HWY_ONCE
