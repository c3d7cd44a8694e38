// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "picture/map_view.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace d2s1r::app
{
namespace
{
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
	constexpr double kWall = 45, kUnknown = 222, kFree = 255;
	const double cells_per_pixel = 1 / (view.scale * grid.cell_size);
	const double emphasis = std::max(1.0, cells_per_pixel);
	std::vector<std::uint8_t> greys;
	greys.reserve(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
	for (int y = 0; y < view.height; y++)
		for (int x = 0; x < view.width; x++)
		{
			const Shares share = sample(grid, x * cells_per_pixel, grid.height - y * cells_per_pixel, cells_per_pixel);
			const double occupied = std::min(1.0, share.occupied * emphasis);
			const double open = std::min(1.0, share.free / std::max(1e-9, 1 - share.occupied));
			const double background = kUnknown + open * (kFree - kUnknown);
			greys.push_back(static_cast<std::uint8_t>(std::lround(background + occupied * (kWall - background))));
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

namespace
{
/// A map on a sheet.
struct OnSheet
{
	const Grid* grid;
	double x, y;  //!< [m] of its lower left corner on the sheet

	double width() const { return grid->width * grid->cell_size; }
	double height() const { return grid->height * grid->cell_size; }
};

/// Maps on a sheet, by name.
struct Placed
{
	std::map<std::string, OnSheet> maps;
	double gap;  //!< [m] between maps, and above the highest
};

/// Places the maps in rows, whose maps are of about one height, on a sheet that is about as wide as high.
Placed placed_on_sheet(const std::vector<IndexedMap>& maps, const std::set<std::string>& used)
{
	constexpr double kLeastGap = 2;       // [m]
	constexpr double kShareOfGap = 0.03;  // [-] of the width: a line of text
	std::vector<std::pair<std::string, OnSheet>> order;
	double area = 0;  // [m^2]
	for (const IndexedMap& map : maps)
		if (used.count(map.entry.name) > 0)
		{
			const Grid& grid = map.map->localizer().grid();
			order.push_back({map.entry.name, {&grid, 0, 0}});
			area += (order.back().second.width() + kLeastGap) * (order.back().second.height() + kLeastGap);
		}
	Placed placed{{}, std::max(kLeastGap, kShareOfGap * std::sqrt(area))};
	std::stable_sort(
	    order.begin(), order.end(), [](const auto& a, const auto& b) { return a.second.height() > b.second.height(); });
	double x = 0, y = 0, height = 0;  // [m] of the row
	for (auto& [name, map] : order)
	{
		if (x > 0 && x + map.width() > std::sqrt(area))
		{
			y += height + placed.gap;
			x = height = 0;
		}
		map.x = x;
		map.y = y;
		x += map.width() + placed.gap;
		height = std::max(height, map.height());
		placed.maps.emplace(name, map);
	}
	return placed;
}

Grid grid_of_sheet(const Placed& placed)
{
	Grid sheet;
	sheet.cell_size = placed.maps.begin()->second.grid->cell_size;
	double width = 0, height = 0;  // [m]
	for (const auto& [name, map] : placed.maps)
	{
		sheet.cell_size = std::min(sheet.cell_size, map.grid->cell_size);
		width = std::max(width, map.x + map.width());
		height = std::max(height, map.y + map.height() + placed.gap);
	}
	sheet.width = static_cast<int>(std::ceil(width / sheet.cell_size));
	sheet.height = static_cast<int>(std::ceil(height / sheet.cell_size));
	sheet.cells.assign(static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height), Cell::kUnknown);
	for (const auto& [name, map] : placed.maps)
	{
		const auto cell = [&](double metres) { return static_cast<int>(std::floor(metres / sheet.cell_size)); };
		for (int row = cell(map.y); row < std::min(sheet.height, cell(map.y + map.height()) + 1); row++)
			for (int column = cell(map.x); column < std::min(sheet.width, cell(map.x + map.width()) + 1); column++)
			{
				const auto there = [&sheet, &grid = *map.grid](int index, double from)
				{ return static_cast<int>(std::floor(((index + 0.5) * sheet.cell_size - from) / grid.cell_size)); };
				const int x = there(column, map.x), y = there(row, map.y);
				if (map.grid->contains(x, y))
					sheet.cells[static_cast<std::size_t>(sheet.index(column, row))] = map.grid->at(x, y);
			}
	}
	return sheet;
}
}  // namespace

Sheet make_sheet(const std::vector<IndexedMap>& maps, const std::vector<Frame>& frames)
{
	std::set<std::string> used;
	for (const Frame& frame : frames)
	{
		if (frame.has_pose()) used.insert(frame.result.best().map);
		if (frame.fused) used.insert(frame.fused->map);
	}
	if (used.empty()) used.insert(maps.front().entry.name);
	const Placed placed = placed_on_sheet(maps, used);
	Sheet sheet{grid_of_sheet(placed), {}, frames};
	for (const auto& [name, map] : placed.maps)
		sheet.names.push_back({name, {map.x, map.y + map.height() + 0.5 * placed.gap}, placed.gap});
	const auto shift = [&](const std::string& name) -> mrpt::math::TPoint2D
	{
		const OnSheet& map = placed.maps.at(name);
		return {map.x - map.grid->origin_x, map.y - map.grid->origin_y};
	};
	const auto move = [&](Localization& result)
	{
		auto& hypotheses = result.hypotheses;
		const auto is_off = [&](const Hypothesis& hypothesis) { return placed.maps.count(hypothesis.map) == 0; };
		hypotheses.erase(std::remove_if(hypotheses.begin(), hypotheses.end(), is_off), hypotheses.end());
		for (Hypothesis& hypothesis : hypotheses)
		{
			hypothesis.pose.x_incr(shift(hypothesis.map).x);
			hypothesis.pose.y_incr(shift(hypothesis.map).y);
		}
	};
	for (Frame& frame : sheet.frames)
	{
		move(frame.result);
		if (!frame.fused) continue;
		frame.fused->pose.x += shift(frame.fused->map).x;
		frame.fused->pose.y += shift(frame.fused->map).y;
	}
	return sheet;
}

bool is_jump(const mrpt::math::TPose2D& from, const mrpt::math::TPose2D& to, double seconds)
{
	const double possible = std::min(kAlwaysPossible + kGreatestSpeed * std::abs(seconds), kGreatestDistance);
	return std::hypot(to.x - from.x, to.y - from.y) > possible;
}

bool is_fused_onwards(const Frame& from, const Frame& to)
{
	return from.fused && to.fused && to.fused->event == FusionEvent::kNone && from.fused->map == to.fused->map;
}

std::vector<std::vector<const Frame*>> path_pieces(const std::vector<Frame>& frames)
{
	std::vector<std::vector<const Frame*>> pieces;
	const Frame* last = nullptr;
	for (const auto& frame : frames)
	{
		if (!frame.localized())
		{
			last = nullptr;
			continue;
		}
		const bool continues = last && last->result.best().map == frame.result.best().map &&
		                       !is_jump(
		                           last->result.best().pose.asTPose(), frame.result.best().pose.asTPose(),
		                           frame.timestamp - last->timestamp);
		if (!continues) pieces.emplace_back();
		pieces.back().push_back(&frame);
		last = &frame;
	}
	return pieces;
}
}  // namespace d2s1r::app
