// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/free_cells.h>

namespace d2s1r
{
std::vector<CellIndex> find_free_cells(const Grid& grid, const FreeCellParameters&)
{
	std::vector<CellIndex> cells;
	for (std::size_t i = 0; i < grid.cells.size(); i++)
		if (grid.cells[i] == Cell::kFree) cells.push_back(static_cast<CellIndex>(i));
	return cells;
}
}  // namespace d2s1r
