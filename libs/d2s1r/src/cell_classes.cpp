// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "cell_classes.h"

#include <algorithm>

namespace d2s1r
{
CellClasses::CellClasses(const GridParameters& parameters)
{
	using Limits = std::numeric_limits<RawCell>;
	classes_.resize(std::size_t{1} << (8 * sizeof(RawCell)), Cell::kUnknown);
	for (int raw = Limits::min(); raw <= Limits::max(); raw++)
	{
		const auto cell = static_cast<RawCell>(raw);
		const double p_occupied = 1.0 - static_cast<double>(mrpt::maps::COccupancyGridMap2D::l2p(cell));
		Cell& its_class = classes_[static_cast<std::make_unsigned_t<RawCell>>(cell)];
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
