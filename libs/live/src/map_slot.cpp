// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_slot.h"

#include <base/errors.h>
#include <base/own_process.h>
#include <d2s1r/for_programs.h>
#include <d2s1r/map_io.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

namespace d2s1r::live
{
namespace
{
/// \throws std::invalid_argument saying what is wrong with the map
mrpt::maps::COccupancyGridMap2D::Ptr grid_of(const ros::OccupancyGrid& map)
{
	if (map.width == 0 || map.height == 0) throw std::invalid_argument("has no cells");
	if (map.percent.size() / map.width != map.height || map.percent.size() % map.width != 0)
		throw std::invalid_argument(
		    mrpt::format("has %zu cells and says that it has %u x %u", map.percent.size(), map.width, map.height));
	std::vector<float> occupied(map.percent.size());
	const auto share = [](std::int8_t percent)
	{
		const bool known = percent >= 0 && percent <= 100;
		return known ? static_cast<float>(percent) / 100.0F : std::numeric_limits<float>::quiet_NaN();
	};
	std::transform(map.percent.begin(), map.percent.end(), occupied.begin(), share);
	return map_of_cells(occupied, map.width, {map.resolution, map.origin.x, map.origin.y, map.origin.phi});
}

std::string describe(const mrpt::maps::COccupancyGridMap2D& grid, const std::string& frame)
{
	return mrpt::format(
	    "map of %.1f x %.1f m, %.3g m cells, frame '%s'", static_cast<double>(grid.getXMax() - grid.getXMin()),
	    static_cast<double>(grid.getYMax() - grid.getYMin()), static_cast<double>(grid.getResolution()), frame.c_str());
}
}  // namespace

void MapSlot::use(std::shared_ptr<const Atlas> maps)
{
	maps_ = std::move(maps);
	const auto& all = maps_->maps();
	description_ = all.size() == 1 ? describe(all.front().localizer->map(), frame_)
	                               : std::to_string(all.size()) + " maps, each in the frame of its name";
}

bool MapSlot::is_present(PublisherId publisher) const
{
	return std::find(publishers_.begin(), publishers_.end(), publisher) != publishers_.end();
}

void MapSlot::add(const ros::OccupancyGrid& map, PublisherId publisher)
{
	Task task;
	try
	{
		task.grid = grid_of(map);
		task.fingerprint = fingerprint_of_map(*task.grid);
		const std::uint64_t needed = memory_to_build(*task.grid, settings_.parameters);
		if (needed > available_memory())
			throw std::invalid_argument(mrpt::format("needs %.1f GB of memory", static_cast<double>(needed) * 1e-9));
	}
	catch (const std::exception& e)
	{
		problem_ = "the map " + one_line(e) + "; it is not used";
		news.push_back(problem_);
		return;
	}
	task.frame = map.header.frame.empty() ? settings_.map_frame : map.header.frame;
	task.publisher = publisher;
	if (settings_.has_maps_of_its_own)
	{
		if (told_ != task.fingerprint && task.frame == frame_)
			news.push_back(
			    "somebody publishes a map, too, in frame '" + frame_ +
			    "', but is not used: make sure that both maps have the same origin, or give yours another frame");
		told_ = task.fingerprint;
		return;
	}
	const Task& current = next_ ? *next_ : task_;
	const bool has_one = maps_ || is_indexing();
	if (has_one && current.fingerprint == task.fingerprint && current.frame == task.frame)
	{
		if (!is_present(current.publisher)) (next_ ? *next_ : task_).publisher = publisher;
		return;
	}
	if (has_one && current.publisher != publisher && is_present(current.publisher))
	{
		if (told_ != task.fingerprint)
			news.push_back(
			    "a second publisher of maps has another one (" + describe(*task.grid, task.frame) +
			    "): the first one's is used until that is gone; stop one of them");
		told_ = task.fingerprint;
		return;
	}
	problem_.clear();
	if (has_one) news.push_back("another map came: silent until it is indexed");
	if (building_.valid())
		next_ = std::move(task);
	else
		start(std::move(task));
}

void MapSlot::set_publishers(const std::vector<PublisherId>& publishers)
{
	publishers_ = publishers;
}

void MapSlot::start(Task task)
{
	maps_.reset();
	task_ = std::move(task);
	building_ = std::async(std::launch::async, [task = task_, settings = settings_] { return build(task, settings); });
}

MapSlot::Built MapSlot::build(const Task& task, const LiveSettings& settings)
{
	const auto indexed = [&]
	{
		std::error_code ignored;
		if (settings.index.empty() || !std::filesystem::exists(settings.index, ignored))
			return std::make_shared<Localizer>(task.grid, settings.parameters);
		try
		{
			return std::make_shared<Localizer>(Localizer::load(settings.index, task.fingerprint, settings.parameters));
		}
		catch (const std::runtime_error&)  // of another map
		{
			return std::make_shared<Localizer>(task.grid, settings.parameters);
		}
	};
	try
	{
		std::shared_ptr<const Localizer> localizer = indexed();
		Built built{std::make_shared<Atlas>(std::vector<AtlasMap>{{"map", localizer, settings.region}}), ""};
		try
		{
			if (!settings.index.empty()) localizer->save(settings.index, task.fingerprint);
		}
		catch (const std::runtime_error& e)
		{
			built.problem = one_line(e);
		}
		return built;
	}
	catch (const std::exception& e)
	{
		return {nullptr, "the map cannot be used: " + one_line(e)};
	}
}

bool MapSlot::poll()
{
	if (!building_.valid() || building_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
	const Built built = building_.get();
	if (built.maps) built_++;
	if (!built.problem.empty()) news.push_back(built.problem);
	if (next_)
	{
		Task task = std::move(*next_);
		next_.reset();
		start(std::move(task));
		return false;
	}
	problem_ = built.maps ? "" : built.problem;
	maps_ = built.maps;
	frame_ = task_.frame;
	description_ = built.maps ? describe(*task_.grid, frame_) : "";
	return built.maps != nullptr;
}

void MapSlot::wait()
{
	if (building_.valid()) building_.wait();
}

std::string MapSlot::frame_of(const std::string& map) const
{
	return maps_ && maps_->maps().size() > 1 ? map : frame_;
}

bool MapSlot::has_frame(const std::string& frame) const
{
	if (!maps_) return frame == settings_.map_frame;
	const auto& all = maps_->maps();
	return std::any_of(all.begin(), all.end(), [&](const AtlasMap& map) { return frame_of(map.name) == frame; });
}
}  // namespace d2s1r::live
