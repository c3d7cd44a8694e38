// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/range_sweep.h>

#include "direction_sweep.h"

#include <cmath>

namespace d2s1r
{
namespace
{
void permute(
    const std::vector<std::uint16_t>& from, const std::vector<std::int32_t>& ranks, std::vector<std::uint16_t>& to)
{
	for (std::size_t i = 0; i < ranks.size(); i++) to[i] = from[static_cast<std::size_t>(ranks[i])];
}
}  // namespace

void sweep_ranges(
    const Grid& grid, const std::vector<CellIndex>& cells, int directions, double max_range, bool stop_at_unknown,
    const RangeSink& sink)
{
	const int limit = max_range_units(grid, max_range);
	const SweepLayout layout = make_sweep_layout(grid, cells);
	std::vector<std::uint16_t> ranges(cells.size()), by_column(cells.size()), hits;
	for (int i = 0; i < directions; i++)
	{
		const SweepDirection direction(2 * M_PI * i / directions);
		const SweepLines& lines = direction.along_x ? layout.along_x : layout.along_y;
		const ColumnRuns& obstacles = stop_at_unknown ? lines.unknown_or_occupied : lines.occupied;
		sweep(lines, obstacles, direction, limit, hits, direction.along_x ? by_column.data() : ranges.data());
		if (direction.along_x) permute(by_column, layout.rank_along_x, ranges);
		sink(i, ranges.data());
	}
}
}  // namespace d2s1r
