// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "live_state.h"

#include <base/errors.h>
#include <d2s1r/motion.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>

namespace d2s1r::live
{
namespace
{
using mrpt::poses::CPose2D;

constexpr Time kOldOdometry = kSecond / 2;        // [ns] beyond, a robot may be anywhere
constexpr double kStandsWithin = 0.05;            // [m] between localized scans of a robot that stands
constexpr double kStandsTurn = mrpt::DEG2RAD(3);  // [rad]
}  // namespace

bool Clock::set(Time time)
{
	const bool ran_back = time < now_ - kStepBack;
	const bool is_known = ran_back_with_ && std::abs(time - *ran_back_with_) < kSecond;
	now_ = time;
	if (!ran_back) return false;
	ran_back_at_ = time;
	ran_back_with_.reset();
	if (!is_known) newest_scan_ = 0;
	return !is_known;
}

bool Clock::take_scan(Time time)
{
	const bool ran_back = time < newest_scan_ - kStepBack;
	if (ran_back) ran_back_with_ = time;
	newest_scan_ = ran_back ? time : std::max(time, newest_scan_);
	return ran_back;
}

bool Clock::is_from_before(Time time) const
{
	return ran_back_at_ != 0 && now_ < ran_back_at_ + kSecond && time > now_ + kStepBack;
}

void WaitingScans::add(WaitingScan scan)
{
	bytes_ += scan.weight();
	scans_.push_back(std::move(scan));
	while (bytes_ > ros::kMostBytesWaiting && scans_.size() > 1) take();
}

WaitingScan WaitingScans::take()
{
	WaitingScan scan = std::move(scans_.front());
	scans_.pop_front();
	bytes_ -= scan.weight();
	return scan;
}

void TrackerInUse::add(Time time, const std::string& in, const CPose2D& pose, PublisherId by)
{
	if (frame != in) clear();
	frame = in;
	publisher = by;
	poses.add(time, pose);
}

std::optional<std::pair<Time, CPose2D>> TrackerInUse::at(Time time, const std::string& in, LiveRobot& robot) const
{
	if (!poses.empty()) return frame == in ? poses.at(time, robot.track()) : std::nullopt;
	const auto pose = robot.frames().pose_in(robot.frame(), in, time);
	return pose ? std::optional(std::pair(time, CPose2D(*pose))) : std::nullopt;
}

void AnsweredScans::clear(bool keeps_last)
{
	monitor.clear();
	window.reset();
	follower.reset();
	tracked_until = 0;
	stood_at.clear();
	robot.reset();
	if (keeps_last) return;
	last.reset();
	last_at = 0;
}

bool AnsweredScans::stands() const
{
	if (stood_at.size() < static_cast<std::size_t>(std::max(monitor.settings().scans, 2))) return false;
	const CPose2D& newest = stood_at.back();
	return std::all_of(
	    stood_at.begin(), stood_at.end(),
	    [&](const CPose2D& pose)
	    {
		    return pose.distanceTo(newest) <= kStandsWithin &&
		           std::abs(mrpt::math::wrapToPi(pose.phi() - newest.phi())) <= kStandsTurn;
	    });
}

void LiveLocalizer::State::clear_after_jump()
{
	if (answered.last || !waiting.empty() || robot.track().newest())
		news.add("the clock ran back: transforms, window and watch start again");
	robot.forget_moving();
	answered.clear(false);
	seeder.clear();
	lasers.clear();
	waiting.clear();
	tracker.clear();
}

/// Returns the least time [ns] between scans that are answered, in the mean.
Time LiveLocalizer::State::period() const
{
	constexpr double kTracked = 20;  // [1/s] odometry tells of a tracked robot as much in between
	const double most = settings.most_scans > 0 ? settings.most_scans : settings.track ? kTracked : HUGE_VAL;
	return static_cast<Time>(static_cast<double>(kSecond) / most);
}

/// Returns whether the scan comes too soon after those that were answered.
bool LiveLocalizer::State::is_early(const WaitingScan& scan) const
{
	constexpr Time kJitter = 10;  // [1/period] of the times of scans
	if (period() == 0 || asked || !answered.last || scan.topic != robot.laser()) return false;
	return scan.header.time < answered.due - period() / kJitter;
}

std::optional<Seed> LiveLocalizer::State::make_seed(const ScanAnswer& given, std::string& problem) const
{
	const Hypothesis& best = given.localization.best();
	const double std_xy = settings.seed_std;
	Seed seed{given.time, given.frame, best.pose, best.covariance};
	seed.covariance += covariance_of(std_xy, std_xy, settings.seed_std_yaw);
	if (robot.calibration.is_open() && !answered.stands())
	{
		problem = "the drive has not confirmed yet how the laser is mounted";
		return std::nullopt;
	}
	if (!expects_odometry() || robot.has_other_clock(given.time)) return seed;
	const auto newest = robot.track().newest();
	if (!newest || given.time - *newest > kOldOdometry)
	{
		if (answered.stands()) return seed;
		problem = newest ? mrpt::format(
		                       "the odometry is %.2f s older than the scan, and the robot moves",
		                       seconds(given.time - *newest))
		                 : "somebody publishes odometry and none has come, and the robot moves";
		return std::nullopt;
	}
	return carried(std::move(seed));
}

Seed LiveLocalizer::State::carried(Seed seed) const
{
	const auto newest = robot.track().newest();
	if (!newest || !expects_odometry() || robot.has_other_clock(seed.time)) return seed;
	const auto then = robot.track().at(seed.time), now = robot.track().at(*newest);
	if (!then || !now) return seed;
	seed.time = *newest;
	seed.pose = seed.pose + (*now - *then);
	return seed;
}

/// Returns how the robot moved since the last answered scan.
std::optional<CPose2D> LiveLocalizer::State::motion_to(const std::optional<CPose2D>& now)
{
	const auto before = std::exchange(answered.robot, now);
	const auto motion = now && before ? std::optional(*now - *before) : std::nullopt;
	return motion && is_plausible(*motion) ? motion : std::nullopt;
}

/// Localizes a scan of the laser in use, with those before it.
ScanAnswer LiveLocalizer::State::localize(
    const WaitingScan& scan, const ReadScan& read, const std::optional<CPose2D>& motion)
{
	const Atlas& atlas = *maps.maps();
	const ScanParameters& parameters = atlas.maps().front().localizer->parameters().scan;
	const auto merged = settings.merge_lasers ? lasers.with(scan.topic) : std::vector<PlacedObservation>();
	ScanAnswer given;
	given.time = scan.header.time;
	if (!read.unusable.empty())
		given.scan.invalid_because = read.unusable;
	else
		given.scan = merged.empty() ? make_scan(*read.placed.observation, parameters, read.placed.sweep)
		                            : merge_scans(merged, parameters);
	auto& follower = answered.follower;
	auto& window = answered.window;
	if (settings.track && !follower) follower.emplace(atlas);
	given.localization = follower ? follower->add(seconds(given.time), given.scan, motion) : atlas.localize(given.scan);
	if (settings.window == 1 || follower) return given;
	if (!window) window.emplace(atlas, settings.window);
	given.localization = window->add(given.scan, given.localization, motion);
	return given;
}

/// Says what the odometry is like, if that is news.
void LiveLocalizer::State::tell_odometry(Time scan)
{
	news.tell("odometry", robot.track().description());
	if (robot.has_other_clock(scan) && !news.has("clock"))
		news.tell(
		    "clock", mrpt::format(
		                 "the times of the odometry are %.0f s off those of the scans, as by another clock: it is not "
		                 "used, and poses and seeds have the times of the scans",
		                 seconds(*robot.track().newest() - scan)));
}

/// Forgets what rests on scans as they were read before.
void LiveLocalizer::State::read_anew()
{
	answered.clear(true);
	seeder.take_back();
	lasers.clear();
}

/// Lets a scan calibrate its laser. Returns whether its scans are read differently from now on.
/// \param together what it says with the scans of its laser before it; null: that is not known
bool LiveLocalizer::State::calibrate(const WaitingScan& scan, const ReadScan& read, const Localization* together)
{
	const Atlas& atlas = *maps.maps();
	const Parameters& parameters = atlas.maps().front().localizer->parameters();
	ros::RunningCalibration& calibration = robot.calibration_of(scan.topic);
	calibration.follow(scan.header.time, read.robot);
	if (parameters.method != Method::kDefault || !read.unusable.empty() || !robot.wants(scan)) return false;
	const auto recorded = robot.recorded(scan);
	if (!recorded) return false;
	const auto localize = [&](const RangeScan& observation, const Sweep& motion)
	{ return atlas.localize(make_scan(observation, parameters.scan, motion)); };
	const Localization alone = localize(*read.placed.observation, read.placed.sweep);
	// A window finds more scans than one alone, but by the motions that are in question.
	const Localization& found = alone.status == Status::kLocalized || !together ? alone : *together;
	bool is_other = false;
	if (found.status == Status::kLocalized)
	{
		const auto& pose = found.best().pose.asTPose();
		is_other = robot.calibrate(atlas.at(found.best().map).localizer->grid(), scan.topic, *recorded, pose);
	}
	else
		is_other = calibration.miss(
		    *recorded, [&](const RangeScan& observation, const Sweep& motion)
		    { return localize(observation, motion).status == Status::kLocalized; });
	news.tell("calibration", robot.calibration_description());
	return is_other;
}

/// Says what became of the pose that a person gave.
void LiveLocalizer::State::tell_suggestion()
{
	if (answered.follower->suggestion() == Suggestion::kTaken)
		news.add("the scans confirm the pose that somebody gave");
	else if (answered.follower->suggestion() == Suggestion::kRefused)
		news.add("the scans do not allow the pose that somebody gave: the robot stays where it is tracked");
}

/// Says how far an answer is to be believed, and what follows from it for the robot's tracker.
void LiveLocalizer::State::judge(ScanAnswer& given, const std::optional<CPose2D>& motion, bool is_read_anew)
{
	ros::Doubt doubt = robot.doubt();
	if (is_read_anew) doubt.why = "from the next scan on, the laser is read as the drive shows";
	ros::apply(doubt, given.localization);
	given.frame = maps.frame_of(given.localization.hypotheses.empty() ? "" : given.localization.best().map);
	if (answered.follower)
		tell_suggestion();
	else
		judge_others(given, motion);
	const Status status = given.localization.status;
	silent_because = status == Status::kLocalized ? "" : given.localization.note;
	if (status == Status::kAmbiguous)
		silent_because = doubt.why.empty() ? "several places explain the scan" : doubt.why;
}

/// Judges the robot's tracker by a scan, and tells it where the robot is if that is due.
void LiveLocalizer::State::judge_others(ScanAnswer& given, const std::optional<CPose2D>& motion)
{
	const Atlas& atlas = *maps.maps();
	const bool has_place = !given.localization.hypotheses.empty();
	const Localizer& localizer =
	    *(has_place ? atlas.at(given.localization.best().map) : atlas.maps().front()).localizer;
	const auto tracked = tracker.at(given.time, given.frame, robot);
	given.watched = answered.monitor.add(
	    localizer, given.scan, given.localization, motion, tracked ? std::optional(tracked->second) : std::nullopt);
	if (given.localization.status == Status::kLocalized)
	{
		answered.stood_at.push_back(given.localization.best().pose);
		while (answered.stood_at.size() > static_cast<std::size_t>(std::max(settings.watch.scans, 2)))
			answered.stood_at.pop_front();
	}
	news.speaker = tracker.publisher;
	given.seed = seeder.consider(
	    given, tracked, [&](const ScanAnswer& a, std::string& problem) { return make_seed(a, problem); });
}

void LiveLocalizer::State::tell_found(const WaitingScan& scan)
{
	const auto& frame = scan.header.frame;
	const auto laser = robot.laser_at(scan.header);
	const std::string where =
	    laser ? mrpt::format(
	                "at x %.3f, y %.3f, z %.3f m, yaw %.1f, roll %.1f deg on '%s'", laser->x(), laser->y(), laser->z(),
	                mrpt::RAD2DEG(laser->yaw()), mrpt::RAD2DEG(laser->roll()), robot.frame().c_str())
	          : "";
	news.tell(
	    "found", "found " + scan.topic + " of '" + frame + "' " + where + "; " + maps.description() + "; " +
	                 (expects_odometry() ? "odometry" : "no odometry") + "; " +
	                 (tracker.seed_readers > 0 ? "a tracker that reads seeds" : "no tracker yet"));
}

/// Returns no value if nothing can be said, and keeps why.
std::optional<ScanAnswer> LiveLocalizer::State::answer(const WaitingScan& scan)
{
	const auto read = robot.read(scan);
	if (!read)
	{
		silent_because = robot.no_transform_from(scan.header.frame);
		news.tell("laser " + scan.topic, silent_because);
		return std::nullopt;
	}
	news.tell("laser " + scan.topic, read->unusable);
	if (settings.merge_lasers && read->unusable.empty())
		lasers.add(scan.topic, scan.header.time, read->placed.observation, read->robot, read->placed.sweep);
	const bool is_in_use = scan.topic == robot.laser();
	std::optional<CPose2D> motion;
	std::optional<ScanAnswer> given;
	if (is_in_use)
	{
		if (std::exchange(robot_frame, robot.frame()) != robot.frame() && answered.last) answered.clear(true);
		if (read->unusable.empty() && !news.has("found")) tell_found(scan);
		motion = motion_to(read->robot);
		given = localize(scan, *read, motion);
		tell_odometry(given->time);
	}
	const bool is_read_anew =
	    calibrate(scan, *read, is_in_use && !settings.merge_lasers ? &given->localization : nullptr);
	if (given) judge(*given, motion, is_read_anew);
	if (is_read_anew) read_anew();
	return given;
}
}  // namespace d2s1r::live
