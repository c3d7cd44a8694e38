// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/robot_track.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

namespace d2s1r::ros
{
namespace
{
using mrpt::math::TPoint2D;
using mrpt::math::TPose2D;
using mrpt::poses::CPose2D;

constexpr Time kKept = 10 * kSecond;                                   // [ns] of readings
constexpr std::size_t kFewestReadings = 1000, kMostReadings = 20'000;  // [-] that are kept
constexpr Time kLongestBeyond = kSecond / 5;  // [ns] that a motion goes on, and between readings

bool is_before(const std::pair<Time, TPose2D>& reading, Time time)
{
	return reading.first < time;
}

/// Returns the ends [m] of the returns of a scan in the frame of the robot, some hundred of them.
std::vector<TPoint2D> points_of(const RangeScan& scan)
{
	constexpr std::size_t kPoints = 200;
	std::vector<TPoint2D> points;
	const std::size_t beams = scan.size(), step = beams / kPoints + 1;
	const auto aperture = static_cast<double>(scan.aperture);
	for (std::size_t i = 0; i < beams; i += step)
	{
		const float range = scan.ranges[i];
		if (!scan.is_valid(i) || !(range < scan.max_range)) continue;
		const double share = beams > 1 ? static_cast<double>(i) / static_cast<double>(beams - 1) - 0.5 : 0;
		const double angle = (scan.right_to_left ? 1 : -1) * aperture * share, length = static_cast<double>(range);
		const auto end = scan.sensor_on_robot.composePoint({length * std::cos(angle), length * std::sin(angle), 0});
		points.emplace_back(end.x, end.y);
	}
	return points;
}

/// Returns how far [m] points are from others, on average, if a robot that sees them moved; each counts for at most
/// 0.3 m.
double distance_between(const std::vector<TPoint2D>& points, const TPose2D& motion, const std::vector<TPoint2D>& others)
{
	constexpr double kMost = 0.3;  // [m]
	double sum = 0;
	for (const TPoint2D& point : points)
	{
		const TPoint2D moved = motion.composePoint(point);
		double nearest = kMost;
		for (const TPoint2D& other : others)
			nearest = std::min(nearest, std::hypot(moved.x - other.x, moved.y - other.y));
		sum += nearest;
	}
	return sum / static_cast<double>(points.size());
}
}  // namespace

void RobotTrack::add(OdometrySource source, Time time, const CPose2D& robot)
{
	Readings& readings = sources_[static_cast<std::size_t>(source)];
	if (time <= 0) return;
	const bool is_set_back =
	    !readings.empty() && (time < readings.front().first || time < readings.back().first - kKept);
	while (is_set_back && !readings.empty() && readings.back().first >= time) readings.pop_back();
	if (!readings.empty() && time <= readings.back().first) return;
	readings.emplace_back(time, robot.asTPose());
	const auto is_enough = [&] { return readings.front().first < time - kKept && readings.size() > kFewestReadings; };
	while (readings.size() > kMostReadings || is_enough()) readings.pop_front();
}

std::optional<TPose2D> RobotTrack::at(const Readings& readings, Time time)
{
	auto after = std::lower_bound(readings.begin(), readings.end(), time, is_before);
	if (after != readings.end() && after->first == time) return after->second;
	if (after == readings.begin() || readings.size() < 2) return std::nullopt;
	const bool is_beyond = after == readings.end();
	if (is_beyond) --after;
	const auto& [t0, a] = *std::prev(after);
	const auto& [t1, b] = *after;
	if (is_beyond && (time - t1 > kLongestBeyond || t1 - t0 > kLongestBeyond)) return std::nullopt;
	return pose_between(a, b, seconds(time - t0) / seconds(t1 - t0));
}

std::optional<CPose2D> RobotTrack::at(Time time) const
{
	const auto pose = at(believed(), time);
	if (!pose) return std::nullopt;
	return moved_ ? *moved_ + CPose2D(*pose) : CPose2D(*pose);
}

Sweep RobotTrack::sweep_of(const SweepTime& sweep, Time stamp, std::size_t beams) const
{
	const auto [from, to] = sweep.span();
	const Time start = stamp + static_cast<Time>(from * 1e9), end = stamp + static_cast<Time>(to * 1e9);
	auto first = std::lower_bound(believed().begin(), believed().end(), start, is_before);
	auto last = std::lower_bound(first, believed().end(), end, is_before);
	first -= std::min<std::ptrdiff_t>(2, first - believed().begin());  // by which the motion is extrapolated
	if (last != believed().end()) ++last;
	std::vector<TimedPose> motion;
	if (!sweep.is_instant())
		std::transform(
		    first, last, std::back_inserter(motion),
		    [stamp = stamp](const Reading& reading) {
			    return TimedPose{seconds(reading.first - stamp), reading.second};
		    });
	return make_sweep(sweep.first_beam, sweep.duration, beams, std::move(motion));
}

std::vector<std::pair<Time, TPose2D>> RobotTrack::readings() const
{
	std::vector<Reading> all(believed().begin(), believed().end());
	for (auto& [time, pose] : all)
		if (moved_) pose = moved_->asTPose() + pose;
	return all;
}

std::optional<Time> RobotTrack::newest() const
{
	return believed().empty() ? std::nullopt : std::optional(believed().back().first);
}

bool RobotTrack::is_known_beforehand(Time time) const
{
	constexpr Time kMoment = kSecond / 40;                 // [ns] in which no robot changes its speed much
	constexpr double kLeastWay = 1e-3, kLeastTurn = 2e-3;  // [m], [rad] of a robot that moves
	if (believed().size() < 2) return false;
	const auto& [t1, last] = believed().back();
	const Time period = t1 - std::prev(believed().end(), 2)->first;
	if (time - t1 <= std::min(kMoment, 2 * period)) return true;
	if (time - t1 > kLongestBeyond) return false;
	for (auto reading = believed().rbegin(); reading != believed().rend(); ++reading)
	{
		const auto& [t0, before] = *reading;
		const bool stands = std::hypot(before.x - last.x, before.y - last.y) < kLeastWay &&
		                    std::abs(mrpt::math::wrapToPi(before.phi - last.phi)) < kLeastTurn;
		if (!stands) return false;
		if (t1 - t0 >= kLongestBeyond) return true;
	}
	return false;
}

void RobotTrack::judge(Time time, const RangeScan& scan)
{
	constexpr Time kLongest = 5 * kSecond;                               // [ns] between scans that are compared
	constexpr double kLeastWay = 0.05, kLeastTurn = mrpt::DEG2RAD(2.0);  // [m], [rad] that motions must differ by
	constexpr double kLeastOff = 0.02, kLeastTimes = 1.5;                // [m], [-] that a wrong motion is off
	constexpr std::size_t kFewest = 20;                                  // [-] points
	if (!believed_ && newest()) believed_ = believed_source();
	if (sources_[0].empty() || sources_[1].empty()) return;
	Reference now{time, points_of(scan)};
	if (now.points.size() < kFewest) return;
	const bool is_usable = reference_ && time > reference_->time && time - reference_->time < kLongest;
	std::array<std::optional<CPose2D>, 2> motions;
	for (std::size_t i = 0; i < motions.size(); i++)
	{
		const auto then = is_usable ? at(sources_[i], reference_->time) : std::nullopt, pose = at(sources_[i], time);
		if (then && pose) motions[i] = CPose2D(*pose) - CPose2D(*then);
	}
	const std::size_t used = *believed_, other = 1 - used;
	if (!motions[used] && motions[other]) believe(other);
	if (motions[0] && motions[1])
	{
		const CPose2D apart = *motions[1] - *motions[0];
		const bool are_equal = apart.norm() < kLeastWay && std::abs(apart.phi()) < kLeastTurn;
		if (are_equal) judged_ = time;
		if (are_equal) return;  // they may still come apart
		for (std::size_t i = 0; i < off_.size(); i++)
			off_[i] += distance_between(now.points, motions[i]->asTPose(), reference_->points);
		if (off_[used] > kLeastTimes * off_[other] + kLeastOff) believe(other);
	}
	judged_ = time;
	reference_ = std::move(now);
}

/// Believes a source whose poses go on where those of the track were at the last scan.
void RobotTrack::believe(std::size_t source)
{
	const auto before = at(judged_);
	believed_ = source;
	is_judged_ = true;
	off_ = {};
	const auto there = at(believed(), judged_);
	if (before && there) moved_ = *before + (-CPose2D(*there));
}

std::string RobotTrack::description() const
{
	if (!is_judged_) return "";
	constexpr const char* kNames[] = {"messages of odometry", "transforms of odometry"};
	const std::size_t used = believed_source();
	return std::string("the ") + kNames[1 - used] + " contradict what the laser sees, or do not cover it; the " +
	       kNames[used] + " agree and are used";
}

void TrackerTrack::add(Time time, const CPose2D& robot)
{
	constexpr std::size_t kMost = 1000;
	told_.erase(told_.upper_bound(time + kKept), told_.end());  // of a clock that was set back
	told_[time] = robot.asTPose();
	if (told_.size() > kMost) told_.erase(told_.begin());
}

std::optional<std::pair<Time, CPose2D>> TrackerTrack::at(Time time, const RobotTrack& robot) const
{
	constexpr Time kAtOnce = 1'000'500;              // [ns] 1 ms and what six decimals round off
	constexpr Time kLongestSilence = kSecond / 2;    // [ns] between two poses that another is made between
	constexpr Time kStillGoodWithout = kSecond / 5;  // [ns] that a pose may be old if nobody measured the motion since
	const auto after = told_.upper_bound(time + kAtOnce);
	if (told_.empty()) return std::nullopt;
	const auto& [told_at, told] = after == told_.begin() ? *after : *std::prev(after);
	if (told_at - time > kStillGoodWithout) return std::nullopt;
	if (std::abs(time - told_at) <= kAtOnce) return std::pair(told_at, CPose2D(told));
	const auto then = robot.at(told_at), now = robot.at(time);
	if (then && now) return std::pair(told_at, CPose2D(told) + (*now - *then));
	// A tracker that jumps does so at once: what is between two of its poses is only used without odometry.
	if (told_at < time && after != told_.end() && after->first - told_at <= kLongestSilence)
		return std::pair(
		    told_at,
		    CPose2D(pose_between(told, after->second, seconds(time - told_at) / seconds(after->first - told_at))));
	return time - told_at <= kStillGoodWithout ? std::optional(std::pair(told_at, CPose2D(told))) : std::nullopt;
}
}  // namespace d2s1r::ros
