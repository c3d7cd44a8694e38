// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "live/live_localizer.h"

#include <base/errors.h>
#include <d2s1r/motion.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "live_state.h"

namespace d2s1r::live
{
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
	state_->answered.window.reset();
	state_->answered.follower.reset();
}

void LiveLocalizer::add_map(const ros::OccupancyGrid& map, PublisherId publisher)
{
	state_->maps.add(map, publisher);
}

void LiveLocalizer::hear(PublisherId publisher)
{
	state_->news.speaker = publisher;
}

void LiveLocalizer::set_map_publishers(const std::vector<PublisherId>& publishers)
{
	state_->maps.set_publishers(publishers);
}

void LiveLocalizer::add_transforms(const std::vector<ros::Transform>& transforms, bool are_static)
{
	std::vector<ros::Transform> taken;
	for (const auto& transform : transforms)
		if (are_static || !state_->clock.is_from_before(transform.header.time)) taken.push_back(transform);
	state_->robot.add_transforms(taken, are_static, state_->news.speaker);
}

void LiveLocalizer::add_odometry(const ros::Odometry& odometry)
{
	if (!state_->clock.is_from_before(odometry.pose.header.time)) state_->robot.add_odometry(odometry);
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
		state.news.tell(
		    "tracker", "the tracker's pose is in '" + header.frame + "', which is not the map's frame: not used");
	else
		state.tracker.add(header.time, header.frame, mrpt::poses::CPose2D(*pose), state.news.speaker);
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
		return state.news.tell(
		    "suggestion", "somebody gave a pose in '" + header.frame + "', which is not the map's frame: not used");
	auto& follower = state.answered.follower;
	if (!follower) follower.emplace(*state.maps.maps());
	follower->suggest({mrpt::poses::CPose2D(*pose), covariance_of(kStd, kStd, kStdYaw)}, map->name);
}

bool LiveLocalizer::is_map_to_odometry(const ros::Transform& transform) const
{
	const bool is_of_map =
	    state_->maps.has_frame(transform.header.frame) || transform.header.frame == state_->settings.map_frame;
	return is_of_map && transform.child == state_->robot.odometry_frame();
}

bool LiveLocalizer::has_odometry() const
{
	const State& state = *state_;
	return state.robot.track().newest() &&
	       !(state.answered.last && state.robot.has_other_clock(state.answered.last->time));
}

std::optional<TrackedPose> LiveLocalizer::take_tracked()
{
	constexpr Time kOldScan = 2 * kSecond;
	State& state = *state_;
	AnsweredScans& answered = state.answered;
	const auto newest = state.robot.track().newest();
	if (!answered.follower || !answered.last || !answered.robot || !newest || *newest <= answered.tracked_until)
		return std::nullopt;
	const Time since = *newest - answered.last->time;
	const auto now = state.robot.track().at(*newest), odometry = state.robot.odometry_at(*newest);
	if (answered.last->localization.status != Status::kLocalized || since > kOldScan || !now || !odometry)
		return std::nullopt;
	const auto robot = answered.follower->after(*now - *answered.robot, seconds(std::max<Time>(0, since)));
	if (!robot) return std::nullopt;
	answered.tracked_until = *newest;
	return TrackedPose{*newest,     answered.last->frame, state.robot.odometry_frame(),
	                   robot->pose, robot->covariance,    robot->pose + (-*odometry)};
}

void LiveLocalizer::set_tracker_readers(int present, int ever)
{
	if (state_->seeder.set_readers(present, ever)) state_->tracker.clear();
	state_->tracker.seed_readers = present;
}

void LiveLocalizer::set_rivals(const std::string& reason)
{
	State& state = *state_;
	hear(0);
	state.news.tell("rivals", reason);
	if (state.rivals.empty() != reason.empty())
	{
		state.answered.clear(true);
		state.seeder.clear();
		state.tracker.clear();
	}
	state.rivals = reason;
}

void LiveLocalizer::add_scan(const std::string& topic, const ros::LaserScan& scan)
{
	add({topic, scan.header, scan, state_->clock.now(), state_->news.speaker});
}

void LiveLocalizer::add_cloud(const std::string& topic, const ros::PointCloud& cloud)
{
	if (state_->settings.cloud_height)
		return add({topic, cloud.header, cloud, state_->clock.now(), state_->news.speaker});
	state_->news.tell(
	    "cloud",
	    topic + " has point clouds, which are not used: set a cloud height, the band whose points make a scan");
}

/// Takes a scan of either kind.
void LiveLocalizer::add(WaitingScan waiting)
{
	const std::string& topic = waiting.topic;
	State& state = *state_;
	const bool is_used = state.robot.laser().empty() || topic == state.robot.laser();
	if (!is_used && !state.settings.merge_lasers) return;
	const Time time = waiting.header.time;
	if (time <= 0) return state.news.tell("stamp", "scans of " + topic + " have no stamp: not used");
	if (state.clock.is_from_before(time)) return;
	if (is_used && state.clock.take_scan(time)) state.clear_after_jump();
	state.robot.look_at(waiting);
	state.waiting.add(std::move(waiting));
}

void LiveLocalizer::request()
{
	state_->asked = true;
	state_->seeder.request();
}

std::vector<ScanAnswer> LiveLocalizer::update(Time now)
{
	State& state = *state_;
	if (state.clock.set(now)) state.clear_after_jump();
	if (state.maps.poll())
	{
		state.answered.clear(true);
		state.seeder.start_again();
		state.robot.forget_found_scans();
	}
	std::vector<ScanAnswer> answers;
	if ((!state.maps.maps() || !state.rivals.empty()) && !state.waiting.empty())
	{
		state.silent_because = !state.rivals.empty()          ? state.rivals
		                       : state.maps.is_indexing()     ? "the map is being indexed"
		                       : state.maps.problem().empty() ? "no map has come yet"
		                                                      : state.maps.problem();
		state.waiting.clear();
	}
	while (!state.waiting.empty())
	{
		const WaitingScan& next = state.waiting.front();
		const bool is_early = state.is_early(next);
		if (!is_early && state.robot.must_wait(next, now - next.since, state.expects_odometry())) break;
		const WaitingScan scan = state.waiting.take();
		state.news.speaker = scan.publisher;
		auto answer = is_early ? std::nullopt : state.answer(scan);
		if (!answer) continue;
		state.asked = false;
		state.answered.last = *answer;
		state.answered.last_at = now;
		const Time period = state.period(), due = state.answered.due;
		state.answered.due = (std::abs(answer->time - due) < period ? due : answer->time) + period;
		answers.push_back(std::move(*answer));
	}
	return answers;
}

Seed LiveLocalizer::carried(const Seed& seed) const
{
	return state_->carried(seed);
}

std::vector<NewsLine> LiveLocalizer::take_news()
{
	return std::exchange(state_->news.lines, {});
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
