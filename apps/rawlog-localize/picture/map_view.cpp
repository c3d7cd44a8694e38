// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "picture/map_view.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace d2s1r::app
{
namespace
{
constexpr int kSamples = 4;  //!< [-] a side of a pixel

/// Returns the cells that the samples of each pixel lie in, along one axis; `cells` outside the map.
/// \param start [cells] where the first pixel begins
/// \param cells_per_pixel negative if pixels run against the cells
std::vector<std::size_t> sampled_cells(int pixels, double start, double cells_per_pixel, int cells)
{
	std::vector<std::size_t> sampled;
	sampled.reserve(static_cast<std::size_t>(pixels) * kSamples);
	for (int pixel = 0; pixel < pixels; pixel++)
		for (int i = 0; i < kSamples; i++)
		{
			const double at = start + pixel * cells_per_pixel + (i + 0.5) * cells_per_pixel / kSamples;
			sampled.push_back(static_cast<std::size_t>(at >= 0 && at < cells ? static_cast<int>(at) : cells));
		}
	return sampled;
}

/// Counts of samples in one number: those that are free, and 256 times those that are occupied.
using Counts = std::uint16_t;

Counts counts_of(Cell cell)
{
	return cell == Cell::kFree ? 1 : cell == Cell::kOccupied ? 256 : 0;
}

/// Counts the samples of one row of cells for each pixel of a row. \param of_cells is overwritten
void count_row(
    const Grid& grid, std::size_t row, const std::vector<std::size_t>& columns, std::vector<Counts>& of_cells,
    std::vector<Counts>& counts)
{
	const auto cells = grid.cells.begin() + grid.index(0, static_cast<int>(row));
	of_cells.assign(static_cast<std::size_t>(grid.width) + 1, 0);  // the last one is that of samples beside the map
	std::transform(cells, cells + grid.width, of_cells.begin(), counts_of);
	static_assert(kSamples == 4);
	for (std::size_t x = 0; x < counts.size(); x++)
	{
		const std::size_t* const of_pixel = &columns[kSamples * x];
		counts[x] = static_cast<Counts>(
		    of_cells[of_pixel[0]] + of_cells[of_pixel[1]] + of_cells[of_pixel[2]] + of_cells[of_pixel[3]]);
	}
}

/// Returns the grey value of each pair of counts.
std::vector<std::uint8_t> greys_of_counts(double emphasis)
{
	constexpr double kWall = 45, kUnknown = 222, kFree = 255, kAll = kSamples * kSamples;
	std::vector<std::uint8_t> greys((kSamples * kSamples + 1) * 256);
	for (int occupied = 0; occupied <= kSamples * kSamples; occupied++)
		for (int open = 0; open + occupied <= kSamples * kSamples; open++)
		{
			const double wall = std::min(1.0, occupied / kAll * emphasis);
			const double share = std::min(1.0, open / kAll / std::max(1e-9, 1 - occupied / kAll));
			const double background = kUnknown + share * (kFree - kUnknown);
			greys[static_cast<std::size_t>(occupied * 256 + open)] =
			    static_cast<std::uint8_t>(std::lround(background + wall * (kWall - background)));
		}
	return greys;
}

constexpr double kStrayShare = 0.03;  //!< [-] of the known cells of the fullest row or column
constexpr double kCropMargin = 1.0;   //!< [m]

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

constexpr double kGreatestSpeed = 2.0;     //!< [m/s]
constexpr double kAlwaysPossible = 0.5;    //!< [m] between frames: poses have errors, clocks too
constexpr double kGreatestDistance = 5.0;  //!< [m] between frames, however long they took
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

std::vector<std::uint8_t> map_greys(const Grid& grid, const MapView& view)
{
	const double cells_per_pixel = 1 / (view.scale * grid.cell_size);
	const auto columns = sampled_cells(view.width, 0, cells_per_pixel, grid.width);
	const auto rows = sampled_cells(view.height, grid.height, -cells_per_pixel, grid.height);
	const auto grey_of = greys_of_counts(std::max(1.0, cells_per_pixel));
	const auto width = static_cast<std::size_t>(view.width), height = static_cast<std::size_t>(grid.height);
	std::vector<Counts> of_cells, of_row(width), of_pixel(width);
	std::size_t counted = height;  // the row of cells that `of_row` is of
	std::vector<std::uint8_t> greys(width * static_cast<std::size_t>(view.height));
	auto grey = greys.begin();
	for (std::size_t i = 0; i < rows.size(); i++)
	{
		if (rows[i] != height && rows[i] != counted) count_row(grid, counted = rows[i], columns, of_cells, of_row);
		if (rows[i] != height)
			std::transform(of_row.begin(), of_row.end(), of_pixel.begin(), of_pixel.begin(), std::plus<Counts>());
		if (i % kSamples + 1 < kSamples) continue;
		grey = std::transform(of_pixel.begin(), of_pixel.end(), grey, [&](Counts counts) { return grey_of[counts]; });
		std::fill(of_pixel.begin(), of_pixel.end(), Counts{0});
	}
	return greys;
}

Grid crop_for_picture(const Grid& grid, const std::vector<mrpt::math::TPoint2D>& points)
{
	std::vector<int> in_column(static_cast<std::size_t>(grid.width)), in_row(static_cast<std::size_t>(grid.height));
	for (std::size_t i = 0; i < grid.cells.size(); i++)
	{
		if (grid.cells[i] == Cell::kUnknown) continue;
		in_column[i % in_column.size()]++;
		in_row[i / in_column.size()]++;
	}
	Interval columns = without_strays(in_column), rows = without_strays(in_row);
	for (const auto& point : points)
	{
		const double column = (point.x - grid.origin_x) / grid.cell_size,
		             row = (point.y - grid.origin_y) / grid.cell_size;
		if (column < 0 || row < 0 || column > grid.width || row > grid.height) continue;
		const double margin = kCropMargin / grid.cell_size;
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

bool is_jump(const mrpt::math::TPose2D& from, const mrpt::math::TPose2D& to, double seconds)
{
	const double possible = std::min(kAlwaysPossible + kGreatestSpeed * std::abs(seconds), kGreatestDistance);
	return std::hypot(to.x - from.x, to.y - from.y) > possible;
}

bool is_fused_onwards(const KeptFrame& from, const KeptFrame& to)
{
	return from.is_fused && to.is_fused && to.event == FusionEvent::kNone && from.fused_map == to.fused_map;
}

std::vector<std::vector<const KeptFrame*>> path_pieces(const std::vector<KeptFrame>& frames)
{
	std::vector<std::vector<const KeptFrame*>> pieces;
	const KeptFrame* last = nullptr;
	for (const auto& frame : frames)
	{
		if (!frame.localized())
		{
			last = nullptr;
			continue;
		}
		const bool continues =
		    last && last->map == frame.map && !is_jump(last->pose, frame.pose, frame.timestamp - last->timestamp);
		if (!continues) pieces.emplace_back();
		pieces.back().push_back(&frame);
		last = &frame;
	}
	return pieces;
}
}  // namespace d2s1r::app
