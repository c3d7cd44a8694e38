// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map/cell_classes.h"

#include <algorithm>

namespace d2s1r
{
CellClasses::CellClasses(const GridParameters& parameters)
{
	using Bits = std::make_unsigned_t<RawCell>;
	classes_.resize(std::size_t{std::numeric_limits<Bits>::max()} + 1, Cell::kUnknown);
	for (std::size_t bits = 0; bits < classes_.size(); bits++)
	{
		const auto cell = static_cast<RawCell>(static_cast<Bits>(bits));
		const double p_occupied = 1.0 - static_cast<double>(mrpt::maps::COccupancyGridMap2D::l2p(cell));
		Cell& its_class = classes_[bits];
		if (p_occupied > parameters.occupied_threshold)
			its_class = Cell::kOccupied;
		else if (p_occupied < parameters.free_threshold)
			its_class = Cell::kFree;
	}
}

bool has_free_cell(const mrpt::maps::COccupancyGridMap2D& map, const CellClasses& classes)
{
	const auto& cells = map.getRawMap();
	return std::any_of(cells.begin(), cells.end(), [&](auto raw) { return classes[raw] == Cell::kFree; });
}
}  // namespace d2s1r
