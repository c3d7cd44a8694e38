// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "live/live_localizer.h"

#include <base/errors.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "live_state.h"

namespace d2s1r::live
{
namespace
{
constexpr std::size_t kMostTopics = 16;  // [-] lasers
}  // namespace

LiveLocalizer::LiveLocalizer(const LiveSettings& settings) : state_(std::make_unique<State>(settings))
{
	if (settings.window < 1) throw std::invalid_argument("the window has no scan");
	for (const double value : {settings.seed_std, settings.seed_std_yaw, settings.most_scans})
		if (!(value >= 0) || !std::isfinite(value))
			throw std::invalid_argument("a standard deviation of seeds or the rate of scans is below 0");
	check(settings.parameters);
}

LiveLocalizer::~LiveLocalizer() = default;

void LiveLocalizer::use_maps(std::shared_ptr<const Atlas> maps)
{
	state_->maps.use(std::move(maps));
	state_->window.reset();
	state_->follower.reset();
}

void LiveLocalizer::add_map(const ros::OccupancyGrid& map, PublisherId publisher)
{
	state_->maps.add(map, publisher);
}

void LiveLocalizer::set_map_publishers(const std::vector<PublisherId>& publishers)
{
	state_->maps.set_publishers(publishers);
}

void LiveLocalizer::add_transforms(const std::vector<ros::Transform>& transforms, bool are_static)
{
	State& state = *state_;
	for (const auto& transform : transforms)
		if (are_static || !state.is_from_before(transform.header.time)) state.frames.add(transform, are_static);
	if (!state.laser_frame.empty()) state.odometry.follow(state.frames, state.robot_frame(state.laser_frame));
}

void LiveLocalizer::add_odometry(const ros::Odometry& odometry)
{
	if (!state_->is_from_before(odometry.pose.header.time)) state_->odometry.add(odometry);
}

void LiveLocalizer::set_odometry_publishers(int count)
{
	state_->odometry_publishers = count;
}

void LiveLocalizer::add_tracker_pose(const ros::Header& header, const std::optional<mrpt::poses::CPose3D>& pose)
{
	State& state = *state_;
	if (!pose || !std::isfinite(pose->x() + pose->y() + pose->yaw())) return;
	if (!state.maps.has_frame(header.frame))
		state.tell(
		    "tracker", "the tracker's pose is in '" + header.frame + "', which is not the map's frame: not used");
	else
		state.tracker = TrackerPose{header.time, header.frame, mrpt::poses::CPose2D(*pose), {}};
}

void LiveLocalizer::suggest(const ros::Header& header, const std::optional<mrpt::poses::CPose3D>& pose)
{
	State& state = *state_;
	constexpr double kStd = 0.5, kStdYaw = 0.26;  // [m, rad] of an arrow that a person draws in RViz
	if (!state.settings.track || !pose || !std::isfinite(pose->x() + pose->y() + pose->yaw())) return;
	const auto is_its_frame = [&](const AtlasMap& map) { return state.maps.frame_of(map.name) == header.frame; };
	if (!state.maps.maps()) return;
	const auto& all = state.maps.maps()->maps();
	const auto map = std::find_if(all.begin(), all.end(), is_its_frame);
	if (map == all.end())
		return state.tell(
		    "suggestion", "somebody gave a pose in '" + header.frame + "', which is not the map's frame: not used");
	if (!state.follower) state.follower.emplace(*state.maps.maps());
	state.follower->suggest({mrpt::poses::CPose2D(*pose), covariance_of(kStd, kStd, kStdYaw)}, map->name);
}

bool LiveLocalizer::is_map_to_odometry(const ros::Transform& transform) const
{
	const bool is_of_map =
	    state_->maps.has_frame(transform.header.frame) || transform.header.frame == state_->settings.map_frame;
	return is_of_map && transform.child == state_->odometry.frame();
}

bool LiveLocalizer::has_odometry() const
{
	return state_->odometry.newest().has_value();
}

std::optional<TrackedPose> LiveLocalizer::take_tracked()
{
	constexpr Time kOldScan = 2 * kSecond;
	State& state = *state_;
	const auto newest = state.odometry.newest();
	if (!state.follower || !state.last || !state.last_odometry || !newest || *newest <= state.tracked_until)
		return std::nullopt;
	const Time since = *newest - state.last->time;
	const auto odometry_now = state.odometry.at(*newest);
	if (state.last->localization.status != Status::kLocalized || since > kOldScan || !odometry_now) return std::nullopt;
	const auto robot = state.follower->after(*odometry_now - *state.last_odometry, seconds(std::max<Time>(0, since)));
	if (!robot) return std::nullopt;
	state.tracked_until = *newest;
	return TrackedPose{*newest,     state.last->frame, state.odometry.frame(),
	                   robot->pose, robot->covariance, robot->pose + (-*odometry_now)};
}

void LiveLocalizer::set_tracker_readers(int present, int ever)
{
	if (state_->seeder.set_readers(present, ever)) state_->tracker.reset();
	state_->seed_readers = present;
}

void LiveLocalizer::set_rivals(const std::string& reason)
{
	State& state = *state_;
	state.tell("rivals", reason);
	if (state.rivals.empty() != reason.empty())
	{
		state.window.reset();
		state.follower.reset();
		state.monitor.clear();
		state.seeder.clear();
		state.tracker.reset();
	}
	state.rivals = reason;
}

void LiveLocalizer::add_scan(const std::string& topic, const ros::LaserScan& scan)
{
	add({topic, scan.header, scan, state_->now});
}

void LiveLocalizer::add_cloud(const std::string& topic, const ros::PointCloud& cloud)
{
	if (state_->settings.cloud_height) return add({topic, cloud.header, cloud, state_->now});
	state_->tell(
	    "cloud",
	    topic + " has point clouds, which are not used: set a cloud height, the band whose points make a scan");
}

/// Takes a scan of either kind.
void LiveLocalizer::add(WaitingScan waiting)
{
	const std::string& topic = waiting.topic;
	State& state = *state_;
	if (state.laser_topic.empty()) state.laser_topic = topic;
	if (topic != state.laser_topic && (!state.settings.merge_lasers || state.others.size() > kMostTopics)) return;
	const Time time = waiting.header.time;
	if (time <= 0) return state.tell("stamp", "scans of " + topic + " have no stamp: not used");
	if (state.is_from_before(time)) return;
	if (time < state.newest_scan - kStepBack)
	{
		state.clear_after_jump();
		state.ran_back_with = time;
	}
	if (topic == state.laser_topic)
	{
		state.newest_scan = std::max(time, state.newest_scan);
		state.laser_frame = waiting.header.frame;
		state.odometry.follow(state.frames, state.robot_frame(state.laser_frame));
		if (const auto* const scan = std::get_if<ros::LaserScan>(&waiting.scan)) state.laser_sweep.add(*scan);
	}
	state.waiting.push_back(std::move(waiting));
	if (state.waiting.size() > 2 * kMostWaiting) state.waiting.pop_front();  // nobody calls update()
}

void LiveLocalizer::request()
{
	state_->asked = true;
	state_->seeder.request();
}

std::vector<ScanAnswer> LiveLocalizer::update(Time now)
{
	State& state = *state_;
	state.set_clock(now);
	if (state.maps.poll())
	{
		state.window.reset();
		state.monitor.clear();
		state.seeder.start_again();
		state.stood_at.clear();
		state.told.erase("found");
	}
	std::vector<ScanAnswer> answers;
	while (!state.waiting.empty())
	{
		if (!state.rivals.empty())
		{
			state.silent_because = state.rivals;
			state.waiting.clear();
			break;
		}
		if (!state.maps.maps())
		{
			state.silent_because = state.maps.is_indexing()       ? "the map is being indexed"
			                       : state.maps.problem().empty() ? "no map has come yet"
			                                                      : state.maps.problem();
			state.waiting.clear();
			break;
		}
		const WaitingScan& next = state.waiting.front();
		const std::string robot = state.robot_frame(next.header.frame);
		if (state.is_early(next))
		{
			state.waiting.pop_front();
			continue;
		}
		if (state.must_wait(next, robot)) break;
		const WaitingScan scan = next;
		state.waiting.pop_front();
		auto answer = state.answer(scan, robot);
		if (!answer) continue;
		state.asked = false;
		state.last = *answer;
		state.last_answer_at = now;
		answers.push_back(std::move(*answer));
	}
	return answers;
}

std::vector<std::string> LiveLocalizer::take_news()
{
	State& state = *state_;
	std::vector<std::string> all;
	for (std::vector<std::string>* part : {&state.maps.news, &state.news, &state.seeder.news})
	{
		for (std::string& line : *part) all.push_back(printable(line));
		part->clear();
	}
	return all;
}

bool LiveLocalizer::is_indexing() const
{
	return state_->maps.is_indexing();
}

void LiveLocalizer::wait_for_index()
{
	state_->maps.wait();
}

int LiveLocalizer::indices_built() const
{
	return state_->maps.built();
}
}  // namespace d2s1r::live
