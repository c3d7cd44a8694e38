// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_view.h"

#include <algorithm>
#include <cmath>

namespace d2s1r::app
{
namespace
{
using mrpt::img::TColor;
constexpr int kSamples = 4;  //!< [-] a side of a pixel

/// Shares of a pixel.
struct Shares
{
	double occupied = 0;
	double free = 0;
};

Shares sample(const Grid& grid, double column, double row, double cells_per_pixel)
{
	int occupied = 0, open = 0;
	for (int i = 0; i < kSamples * kSamples; i++)
	{
		const int c = static_cast<int>(std::floor(column + (i % kSamples + 0.5) * cells_per_pixel / kSamples));
		const int r = static_cast<int>(std::floor(row - (i / kSamples + 0.5) * cells_per_pixel / kSamples));
		if (!grid.contains(c, r)) continue;
		occupied += grid.at(c, r) == Cell::kOccupied;
		open += grid.at(c, r) == Cell::kFree;
	}
	return {1.0 * occupied / (kSamples * kSamples), 1.0 * open / (kSamples * kSamples)};
}

std::uint8_t blend(double background, double wall, double occupied)
{
	return static_cast<std::uint8_t>(std::lround(background + occupied * (wall - background)));
}
}  // namespace

MapView fit_view(const Grid& grid, int long_side, double largest_cell)
{
	const int cells = std::max(grid.width, grid.height);
	const double cell = std::min(largest_cell, 1.0 * long_side / cells);
	MapView view;
	view.scale = cell / grid.cell_size;
	view.left = grid.origin_x;
	view.top = grid.origin_y + grid.height * grid.cell_size;
	view.width = std::max(1, static_cast<int>(std::ceil(grid.width * cell)));
	view.height = std::max(1, static_cast<int>(std::ceil(grid.height * cell)));
	return view;
}

void draw_map(const Grid& grid, const MapView& view, Canvas& canvas)
{
	const double cells_per_pixel = 1 / (view.scale * grid.cell_size);
	const double emphasis = std::max(1.0, cells_per_pixel);
	for (int y = 0; y < view.height; y++)
		for (int x = 0; x < view.width; x++)
		{
			const Shares share = sample(grid, x * cells_per_pixel, grid.height - y * cells_per_pixel, cells_per_pixel);
			const double occupied = std::min(1.0, share.occupied * emphasis);
			const double background = 222 + 33 * std::min(1.0, share.free / std::max(1e-9, 1 - share.occupied));
			const TColor color(
			    blend(background, 40, occupied), blend(background, 44, occupied), blend(background, 52, occupied));
			canvas.point(view.offset_x + x, view.offset_y + y, color);
		}
}
}  // namespace d2s1r::app
