// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "sample_positions.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

namespace d2s1r
{
namespace
{
constexpr int kMostSquares = 1 << 16;  //!< along a side of the map: their places on the curve have 32 bits

/// Position of (column, row), both below kMostSquares, along Hilbert's curve: cells near each other on it are near in
/// the map.
std::uint32_t hilbert_index(std::uint32_t column, std::uint32_t row)
{
	std::uint32_t index = 0;
	for (std::uint32_t side = kMostSquares / 2; side > 0; side /= 2)
	{
		const bool right = (column & side) != 0, upper = (row & side) != 0;
		index = 4 * index + ((right ? 3U : 0U) ^ (upper ? 1U : 0U));
		if (upper) continue;
		if (right) column = ~column, row = ~row;
		std::swap(column, row);
	}
	return index;
}
}  // namespace

std::vector<CellIndex> one_a_square(const Grid& grid, const std::vector<CellIndex>& cells, int side)
{
	struct Choice
	{
		CellIndex cell;
		int distance;
	};
	constexpr Choice kNone{-1, std::numeric_limits<int>::max()};
	std::vector<Choice> chosen(static_cast<std::size_t>(grid.width / side + 1), kNone);  // of one row of squares
	std::vector<CellIndex> samples;
	const auto finish_row = [&]
	{
		const auto first = static_cast<std::ptrdiff_t>(samples.size());
		for (Choice& choice : chosen)
			if (choice.cell != kNone.cell) samples.push_back(std::exchange(choice, kNone).cell);
		std::sort(samples.begin() + first, samples.end());
	};
	int row = 0;
	for (const CellIndex cell : cells)
	{
		for (; cell >= grid.index(0, row + 1); row++)
			if ((row + 1) % side == 0) finish_row();
		const int column = cell - grid.index(0, row);
		const int dx = 2 * (column % side) - side + 1, dy = 2 * (row % side) - side + 1;
		const Choice choice{cell, dx * dx + dy * dy};
		Choice& nearest = chosen[static_cast<std::size_t>(column / side)];
		if (choice.distance < nearest.distance) nearest = choice;
	}
	finish_row();
	return samples;
}

std::vector<PlacedCell> along_curve(const Grid& grid, const std::vector<CellIndex>& samples, int side)
{
	if (std::max(grid.width, grid.height) / side >= kMostSquares)
		throw std::invalid_argument("the map is wider than can be searched; use a greater coarse_search.spacing");
	std::vector<PlacedCell> placed;
	placed.reserve(samples.size());
	for (const CellIndex cell : samples)
		placed.push_back(
		    {hilbert_index(
		         static_cast<std::uint32_t>(cell % grid.width / side),
		         static_cast<std::uint32_t>(cell / grid.width / side)),
		     cell});
	std::sort(placed.begin(), placed.end(), [](const auto& a, const auto& b) { return a.place < b.place; });
	return placed;
}
}  // namespace d2s1r
