// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_slot.h"

#include <base/errors.h>
#include <base/own_process.h>
#include <d2s1r/map_io.h>
#include <d2s1r/memory_to_build.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <limits>
#include <system_error>
#include <thread>

namespace d2s1r::live
{
namespace
{
/// \throws std::invalid_argument saying what is wrong with the map
std::shared_ptr<const OccupancyMap> map_of(const ros::OccupancyGrid& map)
{
	if (map.width == 0 || map.height == 0) throw std::invalid_argument("has no cells");
	if (map.percent.size() / map.width != map.height || map.percent.size() % map.width != 0)
		throw std::invalid_argument(
		    mrpt::format("has %zu cells and says that it has %u x %u", map.percent.size(), map.width, map.height));
	check_number_of_cells(map.width, map.height);
	std::vector<float> occupied(map.percent.size());
	const auto share = [](std::int8_t percent)
	{
		const bool known = percent >= 0 && percent <= 100;
		return known ? static_cast<float>(percent) / 100.0F : std::numeric_limits<float>::quiet_NaN();
	};
	std::transform(map.percent.begin(), map.percent.end(), occupied.begin(), share);
	return map_of_cells(occupied, map.width, {map.resolution, map.origin.x, map.origin.y, map.origin.phi});
}

std::string describe(const OccupancyMap& map, const std::string& frame)
{
	return mrpt::format(
	    "map of %.1f x %.1f m, %.3g m cells, frame '%s'", map.end_x() - static_cast<double>(map.origin_x),
	    map.end_y() - static_cast<double>(map.origin_y), static_cast<double>(map.cell_size), frame.c_str());
}

std::string frame_of_map(const ros::OccupancyGrid& map, const LiveSettings& settings)
{
	return map.header.frame.empty() ? settings.map_frame : map.header.frame;
}

/// Returns whether two messages hold the same map. What is not a number is equal to itself here.
bool are_equal(const ros::OccupancyGrid& a, const ros::OccupancyGrid& b)
{
	const auto same = [](double one, double other) { return !(one < other) && !(other < one); };
	return a.width == b.width && a.height == b.height && same(a.resolution, b.resolution) &&
	       same(a.origin.x, b.origin.x) && same(a.origin.y, b.origin.y) && same(a.origin.phi, b.origin.phi) &&
	       a.header.frame == b.header.frame && a.percent == b.percent;
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
	if (settings_.has_maps_of_its_own)
	{
		if (!told_other_ && frame_of_map(map, settings_) == frame_)
		{
			news_.add(
			    "somebody publishes a map, too, in frame '" + frame_ +
			    "', but is not used: make sure that both maps have the same origin, or give yours another frame");
			told_other_ = true;
		}
		return;
	}
	if (newest_ && are_equal(*newest_, map))
	{
		if (!is_present(publisher_)) publisher_ = publisher;
		return;
	}
	if (newest_ && publisher_ != publisher && is_present(publisher_))
	{
		if (!told_other_)
			news_.add(
			    "a second publisher of maps has another one (" +
			    mrpt::format("%u x %u cells of %.3g m", map.width, map.height, map.resolution) +
			    "): the first one's is used until that is gone; stop one of them");
		told_other_ = true;
		return;
	}
	if (maps_ && !told_change_)
		news_.add("another map came: the one before is used until it is indexed; later ones are not told");
	told_change_ = told_change_ || maps_;
	told_other_ = false;
	newest_ = std::make_shared<const ros::OccupancyGrid>(map);
	publisher_ = publisher;
	if (!building_.valid()) start();
}

void MapSlot::set_publishers(const std::vector<PublisherId>& publishers)
{
	publishers_ = publishers;
}

/// Indexes the newest map on a thread that owns all that it uses, so that nobody has to wait for its end.
void MapSlot::start()
{
	indexed_ = newest_;
	const auto task = std::make_shared<std::packaged_task<Built()>>([map = newest_, settings = settings_]
	                                                                { return build(*map, settings); });
	building_ = task->get_future();
	try
	{
		std::thread([task] { (*task)(); }).detach();
	}
	catch (const std::system_error&)
	{
		(*task)();  // no thread is to be had
	}
}

MapSlot::Built MapSlot::build(const ros::OccupancyGrid& map, const LiveSettings& settings)
{
	Built built;
	try
	{
		const auto grid = map_of(map);
		const std::uint64_t needed = memory_to_build(*grid, settings.parameters);
		if (needed > available_memory())
			throw std::invalid_argument(mrpt::format("needs %.1f GB of memory", static_cast<double>(needed) * 1e-9));
		MadeLocalizer made = settings.make_localizer
		                         ? settings.make_localizer(grid, settings.parameters)
		                         : MadeLocalizer{std::make_shared<const Localizer>(grid, settings.parameters), ""};
		built.note = made.note;
		built.frame = frame_of_map(map, settings);
		built.description = describe(*grid, built.frame);
		built.maps = std::make_shared<Atlas>(std::vector<AtlasMap>{{"map", made.localizer, settings.region}});
	}
	catch (const std::exception& e)
	{
		const std::string why = is_out_of_memory(e) ? "needs more memory than there is" : one_line(e);
		built.note = "the map " + why + "; it is not used";
	}
	return built;
}

bool MapSlot::poll()
{
	if (!building_.valid() || building_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
	const Built built = building_.get();
	news_.speaker = publisher_;
	if (!built.note.empty()) news_.add(built.note);
	if (newest_ != indexed_) start();
	problem_ = built.maps ? "" : built.note;
	if (!built.maps) return false;
	built_++;
	maps_ = built.maps;
	frame_ = built.frame;
	description_ = built.description;
	return true;
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
