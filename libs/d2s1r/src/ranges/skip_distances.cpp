// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ranges/skip_distances.h"

#include <algorithm>
#include <cmath>
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

std::vector<std::uint8_t> skip_distances(const AlignedBytes& classes, int width, int most)
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

bool SkipMap::may_stand(double x, double y, double beside, int reading) const
{
	const double u = (x - origin_x) / cell_size, v = (y - origin_y) / cell_size, reach = beside / cell_size;
	if (!(u >= 1 && v >= 1 && u < width - 1 && v < height - 1)) return false;
	const auto class_at = [&](double column, double row)
	{ return class_of(cells[index(static_cast<int>(column), static_cast<int>(row))], reading); };
	const auto is_seen_from = [&](double column, double row)
	{
		const double to_u = column - u, to_v = row - v;
		const int steps = 1 + static_cast<int>(2 * std::max(std::abs(to_u), std::abs(to_v)));
		bool is_open = true;
		for (int i = 0; i <= steps && is_open; i++)
			is_open = class_at(u + to_u * i / steps, v + to_v * i / steps) != kWall;
		return is_open;
	};
	if (class_at(u, v) == kFree) return true;
	const int last_column = static_cast<int>(std::min(width - 2.0, u + reach));
	const int last_row = static_cast<int>(std::min(height - 2.0, v + reach));
	for (int row = static_cast<int>(std::max(1.0, v - reach)); row <= last_row; row++)
		for (int column = static_cast<int>(std::max(1.0, u - reach)); column <= last_column; column++)
			if (class_at(column, row) == kFree && is_seen_from(column + 0.5, row + 0.5)) return true;
	return false;
}

SkipMap make_skip_map(const Grid& grid, const std::vector<CellIndex>& furniture)
{
	return make_skip_map(grid, grid, furniture);
}

namespace
{
std::uint8_t kind_of(std::uint8_t in_drawn, std::uint8_t in_deeper)
{
	const auto& all = SkipMap::kClasses;
	auto kind = std::find(all.begin(), all.end(), std::array<std::uint8_t, 2>{in_drawn, in_deeper});
	if (kind == all.end()) kind = std::find(all.begin(), all.end(), std::array<std::uint8_t, 2>{in_drawn, in_drawn});
	return static_cast<std::uint8_t>(kind - all.begin());
}

void set_kinds(const SkipMap& map, const Grid& drawn, const Grid& deeper, AlignedBytes& kinds)
{
	std::array<std::array<std::uint8_t, 3>, 3> by_classes{};
	for (std::uint8_t i = 0; i < 3; i++)
		for (std::uint8_t j = 0; j < 3; j++) by_classes[i][j] = kind_of(i, j);
	std::size_t cell = 0;
	for (int row = 0; row < drawn.height; row++)
	{
		std::uint8_t* to = kinds.data() + map.index(1, row + 1);
		for (int column = 0; column < drawn.width; column++, cell++)
			*to++ =
			    by_classes[static_cast<std::size_t>(drawn.cells[cell])][static_cast<std::size_t>(deeper.cells[cell])];
	}
}

void set_furniture(const SkipMap& map, const Grid& drawn, const std::vector<CellIndex>& furniture, AlignedBytes& kinds)
{
	const auto as_furniture = [](std::uint8_t of) { return of == SkipMap::kWall ? SkipMap::kFurniture : of; };
	for (const CellIndex cell : furniture)
	{
		std::uint8_t& kind = kinds[map.index(cell % drawn.width + 1, cell / drawn.width + 1)];
		const auto [in_drawn, in_deeper] = SkipMap::kClasses[kind];
		kind = kind_of(as_furniture(in_drawn), as_furniture(in_deeper));
	}
}
}  // namespace

SkipMap make_skip_map(const Grid& drawn, const Grid& deeper, const std::vector<CellIndex>& furniture)
{
	SkipMap map{
	    drawn.width + 2,
	    drawn.height + 2,
	    drawn.cell_size,
	    drawn.origin_x - drawn.cell_size,
	    drawn.origin_y - drawn.cell_size,
	    {}};
	AlignedBytes cells;
	cells.reserve(map.index(0, map.height) + kGatherOverrun);
	cells.assign(map.index(0, map.height), kind_of(SkipMap::kUnknown, SkipMap::kUnknown));
	set_kinds(map, drawn, deeper, cells);
	set_furniture(map, drawn, furniture, cells);
	const std::vector<std::uint8_t> skips = skip_distances(cells, map.width, SkipMap::kMostSkipped);
	for (std::size_t cell = 0; cell < cells.size(); cell++)
	{
		const bool is_wall = cells[cell] >= SkipMap::kFirstOfWalls;
		const int skip = std::min<int>(skips[cell], is_wall ? SkipMap::kMostSkippedInWalls : SkipMap::kMostSkipped);
		cells[cell] = static_cast<std::uint8_t>((cells[cell] << (8 - SkipMap::kKindBits)) + skip);
	}
	cells.resize(cells.size() + kGatherOverrun);
	map.cells = std::move(cells);
	return map;
}
}  // namespace d2s1r
