// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "live_state.h"

#include <base/errors.h>
#include <d2s1r/mrpt.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>

namespace d2s1r::live
{
namespace
{
using mrpt::poses::CPose2D;

constexpr Time kWaitForFrames = kSecond / 2;      // [ns] that a scan waits for the pose of its laser
constexpr Time kWaitForOdometry = kSecond / 5;    // [ns] that a scan waits for odometry of its time
constexpr Time kOldOdometry = kSecond / 2;        // [ns] beyond, a robot may be anywhere
constexpr Time kOldLaser = kSecond / 2;           // [ns] of scans of several lasers that are merged
constexpr double kStandsWithin = 0.05;            // [m] between localized scans of a robot that stands
constexpr double kStandsTurn = mrpt::DEG2RAD(3);  // [rad]

Time nanoseconds(double seconds)
{
	return static_cast<Time>(seconds * 1e9);
}
}  // namespace

/// Tells a line, unless it is what was told last about the same thing.
void LiveLocalizer::State::tell(const std::string& about, const std::string& line)
{
	std::string& before = told[about];
	if (before != line && !line.empty()) news.push_back(printable(line));
	before = line;
}

void LiveLocalizer::State::clear_after_jump()
{
	const bool had_scans = newest_scan != 0;
	frames.forget_moving();
	odometry.clear();
	monitor.clear();
	seeder.clear();
	window.reset();
	follower.reset();
	tracked_until = 0;
	others.clear();
	waiting.clear();
	last_odometry.reset();
	stood_at.clear();
	tracker.reset();
	last.reset();
	newest_scan = 0;
	last_answer_at = 0;
	if (had_scans) news.push_back("the clock ran back: transforms, window and watch start again");
}

/// Sets the time. If it ran back, all starts again, unless a scan told so already.
void LiveLocalizer::State::set_clock(Time time)
{
	if (time < now - kStepBack)
	{
		const bool is_known = ran_back_with && std::abs(time - *ran_back_with) < kSecond;
		if (!is_known) clear_after_jump();
		ran_back_at = time;
		ran_back_with.reset();
	}
	now = time;
}

/// Returns whether a message was late when the clock ran back: it is from what is the future now.
bool LiveLocalizer::State::is_from_before(Time time) const
{
	return ran_back_at != 0 && now < ran_back_at + kSecond && time > now + kStepBack;
}

std::string LiveLocalizer::State::robot_frame(const std::string& laser) const
{
	if (!settings.robot_frame.empty()) return settings.robot_frame;
	for (const char* frame : {odometry.child().c_str(), "base_link", "base_footprint"})
		if (frames.pose_in(laser, frame, 0)) return frame;
	return odometry.child().empty() ? "base_link" : odometry.child();
}

/// Returns when the beams of a scan were taken, or the points of a cloud.
ros::SweepTime LiveLocalizer::State::sweep_time_of(const WaitingScan& waiting_scan) const
{
	const auto* const cloud = std::get_if<ros::PointCloud>(&waiting_scan.scan);
	if (cloud != nullptr) return settings.sweep.value_or(ros::time_span_of(*cloud)).checked();
	const auto& scan = std::get<ros::LaserScan>(waiting_scan.scan);
	return waiting_scan.topic == laser_topic ? laser_sweep.time_of(scan) : LiveSweep(settings.sweep).time_of(scan);
}

/// Returns a scan where the robot was, with how it moved meanwhile.
PlacedObservation LiveLocalizer::State::placed(
    const WaitingScan& waiting_scan, const mrpt::poses::CPose3D& laser, const CPose2D& robot) const
{
	ros::CloudScan scan;
	if (const auto* const cloud = std::get_if<ros::PointCloud>(&waiting_scan.scan))
	{
		scan = ros::to_observation(*cloud, laser, *settings.cloud_height, waiting_scan.topic);
		scan.sweep = settings.sweep.value_or(scan.sweep).checked();
	}
	else
		scan = {
		    ros::to_observation(std::get<ros::LaserScan>(waiting_scan.scan), laser, waiting_scan.topic),
		    sweep_time_of(waiting_scan)};
	const ros::SweepTime& time = scan.sweep;
	const Time stamp = waiting_scan.header.time;
	const auto [from, to] = time.span();
	const Sweep sweep = make_sweep(
	    time.first_beam, time.duration, scan.observation->getScanSize(),
	    odometry.motion(stamp, stamp + nanoseconds(from), stamp + nanoseconds(to)));
	return {std::make_shared<const RangeScan>(d2s1r::scan_of(*scan.observation)), robot, sweep};
}

/// Returns the sweeps that the map has to decide about, with how the robot moved after a time.
std::vector<Sweep> LiveLocalizer::State::open_sweeps(Time time, std::size_t beams) const
{
	std::vector<Sweep> sweeps;
	for (const ros::SweepTime& open : laser_sweep.open())
	{
		const auto [from, to] = open.span();
		sweeps.push_back(make_sweep(
		    open.first_beam, open.duration, beams,
		    odometry.motion(time, time + nanoseconds(from), time + nanoseconds(to))));
	}
	return sweeps;
}

/// Returns whether the scan comes too soon after the last one that was answered.
bool LiveLocalizer::State::is_early(const WaitingScan& waiting_scan) const
{
	if (settings.most_scans <= 0 || asked || !last || waiting_scan.topic != laser_topic) return false;
	constexpr double kJitter = 1e-3;  // [s]
	return seconds(waiting_scan.header.time - last->time) < 1 / settings.most_scans - kJitter;
}

/// Returns whether what the scan needs may still come.
bool LiveLocalizer::State::must_wait(const WaitingScan& waiting_scan, const std::string& robot) const
{
	if (waiting.size() > kMostWaiting) return false;
	const auto& header = waiting_scan.header;
	const Time waited = now - waiting_scan.since;
	if (!frames.pose_in(header.frame, robot, header.time)) return waited < kWaitForFrames;
	double last_beam = sweep_time_of(waiting_scan).span().second;  // [s]
	for (const ros::SweepTime& open : laser_sweep.open()) last_beam = std::max(last_beam, open.span().second);
	const Time end = header.time + nanoseconds(last_beam);
	return expects_odometry() && odometry.newest().value_or(0) < end && waited < kWaitForOdometry;
}

/// Returns the scan of the laser in use, with those of the other lasers if they are to be merged; no beams if this is
/// another laser, whose scan is kept.
Scan LiveLocalizer::State::scan_of(const std::string& topic, const PlacedObservation& placed) const
{
	const ScanParameters& parameters = maps.maps()->maps().front().localizer->parameters().scan;
	if (!settings.merge_lasers) return make_scan(*placed.observation, parameters, placed.sweep);
	std::vector<PlacedObservation> all;
	for (const auto& [other, last_scan] : others)
		if (std::abs(newest_scan - last_scan.first) <= kOldLaser && other != topic) all.push_back(last_scan.second);
	all.push_back(placed);
	return merge_scans(all, parameters);
}

/// Returns the pose of the tracker at the time of a scan, in the frame of its answer, and when the tracker told it.
std::optional<std::pair<Time, CPose2D>> LiveLocalizer::State::tracker_at(
    const ScanAnswer& given, const std::string& robot)
{
	const Time time = given.time;
	if (!tracker)
	{
		const auto pose = frames.pose_in(robot, given.frame, time);
		return pose ? std::optional(std::pair(time, CPose2D(*pose))) : std::nullopt;
	}
	if (tracker->frame != given.frame) return std::nullopt;
	if (!tracker->odometry) tracker->odometry = odometry.at(tracker->time);
	const auto odometry_now = odometry.at(time);
	if (tracker->odometry && odometry_now)
		return std::pair(tracker->time, tracker->pose + (*odometry_now - *tracker->odometry));
	constexpr Time kSameTime = kSecond / 5;
	if (std::abs(tracker->time - time) <= kSameTime) return std::pair(tracker->time, tracker->pose);
	return std::nullopt;
}

bool LiveLocalizer::State::stands() const
{
	if (stood_at.size() < static_cast<std::size_t>(std::max(settings.watch.scans, 2))) return false;
	const CPose2D& newest = stood_at.back();
	return std::all_of(
	    stood_at.begin(), stood_at.end(),
	    [&](const CPose2D& pose)
	    {
		    return pose.distanceTo(newest) <= kStandsWithin &&
		           std::abs(mrpt::math::wrapToPi(pose.phi() - newest.phi())) <= kStandsTurn;
	    });
}

std::optional<Seed> LiveLocalizer::State::make_seed(const ScanAnswer& given, std::string& problem) const
{
	const Hypothesis& best = given.localization.best();
	const double std_xy = settings.seed_std;
	Seed seed{given.time, given.frame, best.pose, best.covariance};
	seed.covariance += covariance_of(std_xy, std_xy, settings.seed_std_yaw);
	if (!expects_odometry()) return seed;
	const auto newest = odometry.newest();
	if (!newest || given.time - *newest > kOldOdometry)
	{
		if (stands()) return seed;
		problem = newest ? mrpt::format(
		                       "the odometry is %.2f s older than the scan, and the robot moves",
		                       seconds(given.time - *newest))
		                 : "somebody publishes odometry and none has come, and the robot moves";
		return std::nullopt;
	}
	const auto then = odometry.at(given.time), at_newest = odometry.at(*newest);
	if (!then || !at_newest) return seed;
	seed.time = *newest;
	seed.pose = best.pose + (*at_newest - *then);
	return seed;
}

/// Localizes a scan, and judges the tracker by it if there is another one.
void LiveLocalizer::State::localize(
    ScanAnswer& given, const RangeScan& observation, const std::optional<CPose2D>& odometry_now,
    const std::string& robot)
{
	const Atlas& atlas = *maps.maps();
	std::optional<CPose2D> motion;
	if (odometry_now && last_odometry) motion = *odometry_now - *last_odometry;
	last_odometry = odometry_now;
	if (settings.track && !follower) follower.emplace(atlas);
	given.localization = follower ? follower->add(seconds(given.time), given.scan, motion) : atlas.localize(given.scan);
	if (!laser_sweep.open().empty() && !settings.merge_lasers)
		laser_sweep.consider(
		    atlas, given.time, observation, given.scan, given.localization,
		    open_sweeps(given.time, observation.size()));
	tell("sweep", laser_sweep.description());
	if (settings.window > 1 && !follower)
	{
		if (!window) window.emplace(atlas, settings.window);
		given.localization = window->add(given.scan, given.localization, motion);
	}
	given.frame = maps.frame_of(given.localization.hypotheses.empty() ? "" : given.localization.best().map);
	if (follower)
		tell_suggestion();
	else
		judge_others(given, motion, robot);
}

/// Says what became of the pose that a person gave.
void LiveLocalizer::State::tell_suggestion()
{
	if (follower->suggestion() == Suggestion::kTaken)
		news.push_back("the scans confirm the pose that somebody gave");
	else if (follower->suggestion() == Suggestion::kRefused)
		news.push_back("the scans do not allow the pose that somebody gave: the robot stays where it is tracked");
}

/// Judges the robot's tracker by a scan, and tells it where the robot is if that is due.
void LiveLocalizer::State::judge_others(
    ScanAnswer& given, const std::optional<CPose2D>& motion, const std::string& robot)
{
	const Atlas& atlas = *maps.maps();
	const bool has_place = !given.localization.hypotheses.empty();
	const Localizer& localizer =
	    *(has_place ? atlas.at(given.localization.best().map) : atlas.maps().front()).localizer;
	const auto tracked = tracker_at(given, robot);
	given.watched = monitor.add(
	    localizer, given.scan, given.localization, motion, tracked ? std::optional(tracked->second) : std::nullopt);
	if (given.localization.status == Status::kLocalized)
	{
		stood_at.push_back(given.localization.best().pose);
		while (stood_at.size() > static_cast<std::size_t>(std::max(settings.watch.scans, 2))) stood_at.pop_front();
	}
	given.seed = seeder.consider(
	    given, tracked, [&](const ScanAnswer& a, std::string& problem) { return make_seed(a, problem); });
}

void LiveLocalizer::State::tell_found(const WaitingScan& waiting_scan, const std::string& robot)
{
	const auto& frame = waiting_scan.header.frame;
	const auto laser = frames.pose_in(frame, robot, waiting_scan.header.time);
	const std::string where =
	    laser ? mrpt::format(
	                "at x %.3f, y %.3f, z %.3f m, yaw %.1f, roll %.1f deg on '%s'", laser->x(), laser->y(), laser->z(),
	                mrpt::RAD2DEG(laser->yaw()), mrpt::RAD2DEG(laser->roll()), robot.c_str())
	          : "";
	tell(
	    "found", "found " + waiting_scan.topic + " of '" + frame + "' " + where + "; " + maps.description() + "; " +
	                 (expects_odometry() ? "odometry" : "no odometry") + "; " +
	                 (seed_readers > 0 ? "a tracker that reads seeds" : "no tracker yet"));
}

/// Returns no value if nothing can be said, and keeps why.
std::optional<ScanAnswer> LiveLocalizer::State::answer(const WaitingScan& waiting_scan, const std::string& robot)
{
	const auto& header = waiting_scan.header;
	const auto laser = frames.pose_in(header.frame, robot, header.time);
	if (!laser)
	{
		silent_because = "no transform from the laser's frame '" + header.frame + "' to '" + robot +
		                 "' at the time of the scan: publish it on /tf or /tf_static";
		tell("laser", silent_because);
		return std::nullopt;
	}
	tell("laser", "");
	const auto odometry_now = odometry.at(header.time);
	const PlacedObservation here = placed(waiting_scan, *laser, odometry_now.value_or(CPose2D()));
	if (waiting_scan.topic != laser_topic)
	{
		others[waiting_scan.topic] = {header.time, here};
		return std::nullopt;
	}
	if (told["found"].empty()) tell_found(waiting_scan, robot);
	ScanAnswer given;
	given.time = header.time;
	given.scan = scan_of(waiting_scan.topic, here);
	localize(given, *here.observation, odometry_now, robot);
	const Status status = given.localization.status;
	silent_because = status == Status::kLocalized ? "" : given.localization.note;
	if (status == Status::kAmbiguous) silent_because = "several places explain the scan";
	return given;
}
}  // namespace d2s1r::live
