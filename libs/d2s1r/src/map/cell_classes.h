// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <limits>
#include <type_traits>
#include <vector>

namespace d2s1r
{
/// Tells the class of every value that a cell of an MRPT map can hold, by the thresholds. It is a table, because maps
/// have tens of millions of cells and few different values.
class CellClasses
{
   public:
	using RawCell = mrpt::maps::COccupancyGridMap2D::cellType;

	explicit CellClasses(const GridParameters& parameters);

	/// \param raw log-odds of being free, as in COccupancyGridMap2D::getRow()
	Cell operator[](RawCell raw) const { return classes_[static_cast<std::make_unsigned_t<RawCell>>(raw)]; }

   private:
	std::vector<Cell> classes_;  // by the cell's bits read as unsigned
};

/// Returns whether any cell of `map` is free.
bool has_free_cell(const mrpt::maps::COccupancyGridMap2D& map, const CellClasses& classes);
}  // namespace d2s1r
