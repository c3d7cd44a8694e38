// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <cstdint>
#include <vector>

namespace d2s1r
{
/// The free cell nearest to the middle of every square of `side` x `side` cells, increasing.
/// \param cells free ones, increasing
std::vector<CellIndex> one_a_square(const Grid& grid, const std::vector<CellIndex>& cells, int side);

/// A sample and its place along a Hilbert curve through the squares.
struct PlacedCell
{
	std::uint32_t place;
	CellIndex cell;
};

/// Sorted along the curve, so that the positions of a block are near each other and match similarly; the squares of
/// 2 x 2 follow one another. \throws std::invalid_argument if there are more squares along a side of the map than the
/// curve has places for
std::vector<PlacedCell> along_curve(const Grid& grid, const std::vector<CellIndex>& samples, int side);
}  // namespace d2s1r
