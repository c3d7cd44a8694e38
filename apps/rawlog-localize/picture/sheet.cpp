// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "picture/sheet.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace d2s1r::app
{
namespace
{
struct OnSheet
{
	const Grid* grid;
	double x, y;  //!< [m] of its lower left corner on the sheet

	double width() const { return grid->width * grid->cell_size; }
	double height() const { return grid->height * grid->cell_size; }
};

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
			const Grid& grid = map.localizer->grid();
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

std::string with_utf8_only(const std::string& text)
{
	using nlohmann::json;
	const std::string quoted = json(text).dump(-1, ' ', false, json::error_handler_t::replace);
	return json::parse(quoted.data(), quoted.data() + quoted.size()).get<std::string>();
}

DrawnFrames::DrawnFrames(const FrameStore& frames, std::map<std::string, mrpt::math::TPoint2D> shifts)
    : store_(frames), shifts_(std::move(shifts)), moved_(frames.kept())
{
	for (KeptFrame& frame : moved_)
	{
		if (frame.has_pose) move(frames.map_names()[frame.map], frame.pose);
		if (frame.is_fused) move(frames.map_names()[frame.fused_map], frame.fused);
	}
}

void DrawnFrames::move(const std::string& map, mrpt::math::TPose2D& pose) const
{
	pose.x += shifts_.at(map).x;
	pose.y += shifts_.at(map).y;
}

void DrawnFrames::visit(const std::function<void(const Frame&)>& look) const
{
	if (shifts_.empty()) return store_.visit(look);
	const auto is_off = [this](const Hypothesis& hypothesis) { return shifts_.count(hypothesis.map) == 0; };
	store_.visit(
	    [&](Frame frame)
	    {
		    auto& hypotheses = frame.result.hypotheses;
		    hypotheses.erase(std::remove_if(hypotheses.begin(), hypotheses.end(), is_off), hypotheses.end());
		    for (Hypothesis& hypothesis : hypotheses)
		    {
			    mrpt::math::TPose2D pose = hypothesis.pose.asTPose();
			    move(hypothesis.map, pose);
			    hypothesis.pose = mrpt::poses::CPose2D(pose);
		    }
		    if (frame.fused) move(frame.fused->map, frame.fused->pose);
		    look(frame);
	    });
}

Sheet make_sheet(const std::vector<IndexedMap>& maps, const FrameStore& frames)
{
	std::set<std::string> used(frames.map_names().begin(), frames.map_names().end());
	if (used.empty()) used.insert(maps.front().entry.name);
	const Placed placed = placed_on_sheet(maps, used);
	Sheet sheet{grid_of_sheet(placed), {}, {}};
	for (const auto& [name, map] : placed.maps)
	{
		sheet.names.push_back({name, {map.x, map.y + map.height() + 0.5 * placed.gap}, placed.gap});
		sheet.shifts[name] = {map.x - map.grid->origin_x, map.y - map.grid->origin_y};
	}
	return sheet;
}
}  // namespace d2s1r::app
