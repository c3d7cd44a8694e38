// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_crop.h"

#include <algorithm>
#include <cmath>

namespace d2s1r::app
{
namespace
{
constexpr double kStrayShare = 0.03;  //!< [-] of the known cells of the fullest row or column
constexpr double kMargin = 1.0;       //!< [m]

struct Interval
{
	int first = 0;  //!< [cells]
	int past = 0;   //!< [cells]

	void include(double low, double high, int size)
	{
		first = std::clamp(static_cast<int>(std::floor(low)), 0, first);
		past = std::clamp(static_cast<int>(std::ceil(high)), past, size);
	}
};

Interval without_strays(const std::vector<int>& known)
{
	const double least = kStrayShare * *std::max_element(known.begin(), known.end());
	const auto full = [&](int count) { return count >= least; };
	const auto first = std::find_if(known.begin(), known.end(), full);
	const auto past = std::find_if(known.rbegin(), known.rend(), full).base();
	return {static_cast<int>(first - known.begin()), static_cast<int>(past - known.begin())};
}
}  // namespace

Grid crop_for_picture(const Grid& grid, const std::vector<mrpt::math::TPoint2D>& points)
{
	std::vector<int> in_column(static_cast<std::size_t>(grid.width)), in_row(static_cast<std::size_t>(grid.height));
	for (std::size_t i = 0; i < grid.cells.size(); i++)
		if (grid.cells[i] != Cell::kUnknown) in_column[i % in_column.size()]++, in_row[i / in_column.size()]++;
	Interval columns = without_strays(in_column), rows = without_strays(in_row);
	for (const auto& point : points)
	{
		const double column = (point.x - grid.origin_x) / grid.cell_size,
		             row = (point.y - grid.origin_y) / grid.cell_size;
		if (column < 0 || row < 0 || column > grid.width || row > grid.height) continue;
		const double margin = kMargin / grid.cell_size;
		columns.include(column - margin, column + margin, grid.width);
		rows.include(row - margin, row + margin, grid.height);
	}

	Grid part;
	part.width = columns.past - columns.first;
	part.height = rows.past - rows.first;
	part.cell_size = grid.cell_size;
	part.origin_x = grid.origin_x + columns.first * grid.cell_size;
	part.origin_y = grid.origin_y + rows.first * grid.cell_size;
	for (int row = rows.first; row < rows.past; row++)
	{
		const auto start = grid.cells.begin() + grid.index(columns.first, row);
		part.cells.insert(part.cells.end(), start, start + part.width);
	}
	return part;
}
}  // namespace d2s1r::app
