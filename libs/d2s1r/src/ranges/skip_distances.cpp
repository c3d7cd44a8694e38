// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ranges/skip_distances.h"

#include <algorithm>
#include <utility>

namespace d2s1r
{
namespace
{
/// Does one row of a pass in raster order (direction -1) or against it (1): it looks at the four neighbours whose
/// distances are known.
/// \param classes, distances of the row, which has others before and after it
void relax_row(const std::uint8_t* classes, std::uint8_t* distances, std::ptrdiff_t width, std::ptrdiff_t direction)
{
	for (const std::ptrdiff_t to : {direction * width - 1, direction * width, direction * width + 1})
		for (std::ptrdiff_t cell = 1; cell < width - 1; cell++)
		{
			const int same = classes[cell + to] == classes[cell] ? 1 : 0;
			const int near = same * distances[cell + to];  // a product, which compilers vectorize
			distances[cell] = static_cast<std::uint8_t>(std::min<int>(distances[cell], near + 1));
		}
	int near = 0;
	for (std::ptrdiff_t i = 1, cell = direction < 0 ? 1 : width - 2; i < width - 1; i++, cell -= direction)
	{
		if (classes[cell + direction] != classes[cell]) near = 0;
		near = std::min<int>(distances[cell], near + 1);
		distances[cell] = static_cast<std::uint8_t>(near);
	}
}
}  // namespace

std::vector<std::uint8_t> skip_distances(const std::vector<std::uint8_t>& classes, int width, int most)
{
	std::vector<std::uint8_t> distances(classes.size() + kGatherOverrun);
	const auto w = static_cast<std::size_t>(width);
	for (std::size_t row = w; row + w < classes.size(); row += w)
	{
		std::fill_n(distances.data() + row + 1, w - 2, static_cast<std::uint8_t>(most));
		relax_row(classes.data() + row, distances.data() + row, width, -1);
	}
	for (std::size_t row = classes.size() - 2 * w; row > 0; row -= w)
		relax_row(classes.data() + row, distances.data() + row, width, 1);
	return distances;
}

SkipMap make_skip_map(const Grid& grid, const std::vector<CellIndex>& furniture)
{
	constexpr int kMostSkipped = 63;           // [cells] that fit in six bits
	constexpr std::uint8_t kFurniture = 0b11;  // class of occupied cells of furniture
	SkipMap map{grid.width + 2,
	            grid.height + 2,
	            grid.cell_size,
	            grid.origin_x - grid.cell_size,
	            grid.origin_y - grid.cell_size,
	            {}};
	std::vector<std::uint8_t> classes(map.index(0, map.height), static_cast<std::uint8_t>(Cell::kUnknown));
	auto from = grid.cells.begin();
	for (int row = 0; row < grid.height; row++)
	{
		auto to = classes.begin() + static_cast<std::ptrdiff_t>(map.index(1, row + 1));
		for (int column = 0; column < grid.width; column++) *to++ = static_cast<std::uint8_t>(*from++);
	}
	for (const CellIndex cell : furniture)
	{
		std::uint8_t& at = classes[map.index(cell % grid.width + 1, cell / grid.width + 1)];
		if (at == static_cast<std::uint8_t>(Cell::kOccupied)) at = kFurniture;
	}
	std::vector<std::uint8_t> cells = skip_distances(classes, map.width, kMostSkipped);
	for (std::size_t cell = 0; cell < classes.size(); cell++)
		cells[cell] = static_cast<std::uint8_t>((cells[cell] << SkipMap::kClassBits) | classes[cell]);
	map.cells = std::move(cells);
	return map;
}
}  // namespace d2s1r
