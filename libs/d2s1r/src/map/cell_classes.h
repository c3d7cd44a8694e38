// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <array>
#include <cstdint>

namespace d2s1r
{
/// Tells the class of every value that a cell of a map can hold, by the thresholds. It is a table, because maps have
/// tens of millions of cells and few different values.
class CellClasses
{
   public:
	explicit CellClasses(const GridParameters& parameters);

	/// \param cell of an OccupancyMap
	Cell operator[](std::int8_t cell) const { return classes_[static_cast<std::uint8_t>(cell)]; }

   private:
	std::array<Cell, 256> classes_{};  // by the cell's bits read as unsigned
};

/// Returns whether any cell of `map` is free.
bool has_free_cell(const OccupancyMap& map, const CellClasses& classes);
}  // namespace d2s1r
