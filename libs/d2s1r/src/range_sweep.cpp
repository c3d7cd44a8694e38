// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/range_sweep.h>

#include "range_sweep_kernel.h"

#include <cmath>

namespace d2s1r
{
void sweep_ranges(
    const Grid& grid, const std::vector<CellIndex>& cells, int directions, double max_range, bool stop_at_unknown,
    const RangeSink& sink)
{
	const int limit = max_range_units(grid, max_range);
	const SweepLayout layout = make_sweep_layout(grid, cells);
	const auto ranks_along_x = ranks_of(cells, grid, true), ranks_along_y = ranks_of(cells, grid, false);
	std::vector<std::uint16_t> ranges(cells.size()), hits;
	for (int i = 0; i < directions; i++)
	{
		const SweepDirection direction(2 * M_PI * i / directions);
		const SweepLines& lines = direction.along_x ? layout.along_x : layout.along_y;
		const ColumnRuns& obstacles = stop_at_unknown ? lines.unknown_or_occupied : lines.occupied;
		sweep(lines, obstacles, direction, limit, hits, ranges.data());
		sink(i, {ranges.data(), (direction.along_x ? ranks_along_x : ranks_along_y).data()});
	}
}
}  // namespace d2s1r
