// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/array.h"

namespace d2s1r
{
/// [byte] How far kernels read behind the last cell of a map, because they gather cells as words of four bytes.
inline constexpr std::size_t kGatherOverrun = 3;

/// Returns the skip distance of each cell of a map: the Chebyshev distance [cells] to the nearest cell of another
/// class, at most `most`, and 0 in a margin of one cell, which counts as another class. kGatherOverrun bytes follow.
/// \param classes row-major, with the margin
/// \param width [cells] with the margin
std::vector<std::uint8_t> skip_distances(const std::vector<std::uint8_t>& classes, int width, int most);

/// The cells of a grid, and of a margin of one cell around it, with their skip distances: how far a ray may go in any
/// direction before it meets something new. It needs one byte per cell. Copies share it.
struct SkipMap
{
	static constexpr int kClassBits = 2;  //!< [bit] of a cell that hold its class
	static constexpr int kOccupied = 1;   //!< the bit of these that all classes of occupied cells have, and no other

	int width = 0, height = 0;          //!< [cells] with the margin
	double cell_size = 0;               //!< [m]
	double origin_x = 0, origin_y = 0;  //!< [m] map frame, lower left corner of the margin
	/// By cell, row-major, its class in the two low bits: Cell, or 3 for an occupied cell of furniture. Above them is
	/// its skip distance [cells], at most 63, or 0 in the margin. kGatherOverrun bytes follow.
	Array<std::uint8_t> cells;

	/// Returns the position of a cell in `cells`.
	std::size_t index(int column, int row) const
	{
		return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
	}

	/// Returns whether a cell is inside of the margin.
	bool is_inside(int column, int row) const
	{
		return column > 0 && row > 0 && column < width - 1 && row < height - 1;
	}

	/// Lists what an index file holds of the map.
	template <class Self, class File>
	static void fields(Self& self, File& file)
	{
		file(self.width);
		file(self.height);
		file(self.cell_size);
		file(self.origin_x);
		file(self.origin_y);
		file(self.cells);
	}
};

/// Makes the map of `grid`.
/// \param furniture cells that count as furniture where they are occupied: see find_furniture()
SkipMap make_skip_map(const Grid& grid, const std::vector<CellIndex>& furniture = {});
}  // namespace d2s1r
