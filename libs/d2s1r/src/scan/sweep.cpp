// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "scan/sweep.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace d2s1r
{
namespace
{
using mrpt::math::TPose2D;

constexpr double kLongestGap = 0.5;  //!< [s] without a measured pose; over a longer one, a motion is a guess
constexpr double kFastest = 20;      //!< [m/s], [rad/s] beyond, odometry was reset or jumped
/// [-] of a measured motion, as OdometryTuning::error_share, and chosen by hand like it. It is too much for odometry
/// without errors.
constexpr double kErrorShare = 0.1;
constexpr double kAcceleration = 1;  //!< [m/s^2], [rad/s^2] of a usual robot between two measured poses

bool is_finite(const TPose2D& pose)
{
	return std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.phi);
}
}  // namespace

TPose2D pose_between(const TPose2D& from, const TPose2D& to, double share)
{
	const TPose2D motion = to - from;
	return from + TPose2D(share * motion.x, share * motion.y, share * mrpt::math::wrapToPi(motion.phi));
}

std::vector<TimedPose> poses_along(const mrpt::math::TTwist2D& twist, double from, double to)
{
	constexpr int kSteps = 10;
	const double step = (to - from) / kSteps;
	// The chord of an arc is shorter than the arc, and in the middle of both headings.
	const double turn = twist.omega * step, half = 0.5 * turn;
	const double chord = std::abs(half) > 1e-9 ? std::sin(half) / half : 1.0;
	const double x = twist.vx * step * chord, y = twist.vy * step * chord;
	const TPose2D motion(std::cos(half) * x - std::sin(half) * y, std::sin(half) * x + std::cos(half) * y, turn);
	std::vector<TimedPose> poses = {{from, {}}};
	for (int i = 1; i <= kSteps; i++) poses.push_back({from + i * step, poses.back().robot + motion});
	return poses;
}

bool is_usable(const Sweep& sweep, std::size_t beams)
{
	constexpr double kLatest = 10;  // [s]
	const auto is_near = [](double time) { return std::abs(time) <= kLatest; };
	if (!is_near(sweep.first_beam) || !is_near(sweep.time_of(beams))) return false;
	if (!(sweep.unknown_speed >= 0 && sweep.unknown_turn >= 0)) return false;
	double before = -HUGE_VAL;
	for (const TimedPose& pose : sweep.motion)
		if (!(std::exchange(before, pose.time) < pose.time && std::isfinite(pose.time) && is_finite(pose.robot)))
			return false;
	return true;
}

Sweep make_sweep(double first_beam, double duration, std::size_t beams, std::vector<TimedPose> motion)
{
	Sweep sweep;
	sweep.first_beam = first_beam;
	if (beams > 1) sweep.beam_step = duration / static_cast<double>(beams - 1);
	sweep.motion = std::move(motion);
	return is_usable(sweep, beams) ? sweep : Sweep();
}

SweptMotion::SweptMotion(const Sweep& sweep, std::size_t beams) : sweep_(sweep)
{
	std::tie(first_, last_) = std::minmax({sweep.time_of(0), sweep.time_of(beams > 0 ? beams - 1 : 0)});
	const std::vector<TimedPose>& poses = sweep.motion;
	if (poses.size() < 2) return;
	const double from = std::min(first_, 0.0), to = std::max(last_, 0.0);
	const double beyond = std::max({0.0, poses.front().time - from, to - poses.back().time});
	double gap = beyond;  // [s] longest time without a measured pose
	for (std::size_t i = 1; i < poses.size(); i++)
	{
		const double step = poses[i].time - poses[i - 1].time;
		const bool is_before = poses[i].time < from && i + 1 < poses.size();
		if (is_before || (poses[i - 1].time > to && i > 1)) continue;
		const TPose2D motion = poses[i].robot - poses[i - 1].robot;
		gap = std::max(gap, step);
		unseen_ = std::max(unseen_, 0.125 * step * step);                             // in the middle between two
		if (beyond > 0) unseen_ = std::max(unseen_, 0.5 * (step + beyond) * beyond);  // after both
		speed_ = std::max(speed_, motion.norm() / step);
		turn_ = std::max(turn_, std::abs(mrpt::math::wrapToPi(motion.phi)) / step);
	}
	is_known_ = gap < kLongestGap && speed_ < kFastest && turn_ < kFastest;
	if (is_known_) at_zero_ = measured_at(0);
}

TPose2D SweptMotion::measured_at(double time) const
{
	const std::vector<TimedPose>& poses = sweep_.motion;
	const auto is_earlier = [](const TimedPose& pose, double when) { return pose.time < when; };
	auto after = std::lower_bound(poses.begin() + 1, poses.end() - 1, time, is_earlier);
	const TimedPose& before = *(after - 1);
	return pose_between(before.robot, after->robot, (time - before.time) / (after->time - before.time));
}

TPose2D SweptMotion::robot_at(double time) const
{
	return is_known_ ? measured_at(time) - at_zero_ : TPose2D();
}

double SweptMotion::std_of(double unknown, double known) const
{
	// Walls are not all around: the beams that fix the pose may be a part of the sweep, of which there are some four.
	constexpr double kParts = 4;
	const double middle = 0.5 * (first_ + last_), spread = (last_ - first_) / std::sqrt(12.0);
	const double off = std::hypot(middle, spread / std::sqrt(kParts));  // [s]
	if (!is_known_) return unknown * off;
	return kErrorShare * known * off + std::min(unknown * off, kAcceleration * unseen_);
}

BeamMover::BeamMover(const RangeScan& observation, const Sweep& sweep)
    : sweep_(sweep),
      motion_(sweep, observation.size()),
      aperture_(static_cast<double>(observation.aperture)),
      step_(aperture_ / static_cast<double>(observation.size() - 1))
{
	const auto& axes = observation.sensor_on_robot.getRotationMatrix();
	const bool upside_down = axes(2, 2) < 0;
	sign_ = observation.right_to_left != upside_down ? 1 : -1;
	// The heading of the sensor's x axis seen from above: the yaw, but half a turn off it if the sensor is turned over
	// by its pitch. The height does not matter in a plane.
	sensor_ = {observation.sensor_on_robot.x(), observation.sensor_on_robot.y(), std::atan2(axes(1, 0), axes(0, 0))};
}

double BeamMover::angle_of(std::size_t beam) const
{
	return sign_ * (static_cast<double>(beam) * step_ - aperture_ / 2);
}

Beam BeamMover::moved(const Beam& read, std::size_t index) const
{
	const double angle = angle_of(index), range = static_cast<double>(read.range);
	if (!moves()) return {beam_angle(angle), read.range, read.is_return};
	const mrpt::math::TPose2D then = motion_.robot_at(sweep_.time_of(index)) + sensor_;
	const mrpt::math::TPose2D end = then + mrpt::math::TPose2D(range * std::cos(angle), range * std::sin(angle), 0);
	const mrpt::math::TPose2D seen = end - sensor_;
	return {beam_angle(std::atan2(seen.y, seen.x)), static_cast<float>(std::hypot(seen.x, seen.y)), read.is_return};
}

RangeScan at_one_time(const RangeScan& observation, const Sweep& sweep)
{
	const std::size_t beams = observation.size();
	RangeScan moved = observation;
	if (sweep.is_instant() || !is_usable(sweep, beams) || beams < 2) return moved;
	const BeamMover mover(observation, sweep);
	if (!mover.moves()) return moved;
	const double aperture = static_cast<double>(observation.aperture);
	const double step = aperture / static_cast<double>(beams - 1);
	std::vector<double> off(beams, 1.0);  // [steps] of the beam that a direction has got
	moved.ranges.assign(beams, NAN);
	moved.valid.assign(beams, 0);
	for (std::size_t i = 0; i < beams; i++)
	{
		const float range = observation.ranges[i];
		const bool is_return = observation.is_valid(i) && range < observation.max_range;
		const Beam beam = mover.moved({0, is_return ? range : observation.max_range, is_return}, i);
		double at = (mover.sign() * static_cast<double>(beam.angle) + aperture / 2) / step;
		at -= std::floor(at * step / (2 * M_PI)) * 2 * M_PI / step;  // beams of a full circle come in again
		const auto to = static_cast<std::size_t>(std::lround(at));
		if (to >= beams || std::abs(at - static_cast<double>(to)) >= off[to]) continue;
		off[to] = std::abs(at - static_cast<double>(to));
		moved.ranges[to] = is_return ? beam.range : range;
		moved.valid[to] = observation.is_valid(i) ? 1 : 0;
	}
	return moved;
}
}  // namespace d2s1r
