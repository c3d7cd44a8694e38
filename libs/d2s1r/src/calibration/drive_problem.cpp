// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "calibration/drive_problem.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

namespace d2s1r::calibration
{
using mrpt::math::TPose2D;
using mrpt::math::wrapToPi;

double& value_in(Reading& reading, std::size_t unknown)
{
	const std::array<double*, kUnknowns> values = {&reading.laser.phi,    &reading.laser.x,   &reading.laser.y,
	                                               &reading.start,        &reading.duration,  &reading.angle_scale,
	                                               &reading.range_factor, &reading.way_scale, &reading.turn_scale};
	return *values[unknown];
}

double told_value(const Reading& told, const Reading& reading, std::size_t unknown)
{
	const bool is_reversed = reading.duration * told.duration < 0;
	return unknown == kStart && is_reversed ? told.first_beam() : value_of(told, static_cast<Unknown>(unknown));
}

double difference(std::size_t unknown, double a, double b)
{
	return unknown == kYaw ? wrapToPi(a - b) : a - b;
}

Track::Track(const std::vector<TimedPose>& poses) : poses_(poses)
{
	covered_.reserve(poses.size());
	for (std::size_t i = 0; i < poses.size(); i++)
	{
		const TPose2D step = i > 0 ? poses[i].robot - poses[i - 1].robot : TPose2D();
		const Eigen::Vector2d covered(std::hypot(step.x, step.y), std::abs(wrapToPi(step.phi)));
		covered_.push_back(i > 0 ? Eigen::Vector2d(covered_.back() + covered) : covered);
	}
}

std::optional<TPose2D> Track::at(double time) const
{
	constexpr double kBeyond = 0.2;  // [s] in which a robot goes on as before; a scan may end after the last reading
	if (poses_.empty() || time < poses_.front().time - kBeyond || time > poses_.back().time + kBeyond)
		return std::nullopt;
	if (poses_.size() == 1) return poses_.front().robot;
	constexpr double kSpan = 0.1;  // [s] over which a speed is told: readings may come in bursts
	const auto is_before = [](const TimedPose& pose, double t) { return pose.time < t; };
	const auto after = std::lower_bound(poses_.begin() + 1, poses_.end() - 1, time, is_before);
	const bool is_beyond = time > after->time;
	const auto since = is_beyond ? std::lower_bound(poses_.begin() + 1, after, after->time - kSpan, is_before) : after;
	const auto before = std::prev(since);
	const TPose2D &a = before->robot, &b = after->robot;
	const double share = (time - before->time) / (after->time - before->time);
	return TPose2D(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.phi + share * wrapToPi(b.phi - a.phi));
}

Eigen::Vector2d Track::covered(double time) const
{
	if (poses_.size() < 2) return Eigen::Vector2d::Zero();
	const auto is_before = [](const TimedPose& pose, double t) { return pose.time < t; };
	const auto after = std::lower_bound(poses_.begin() + 1, poses_.end() - 1, time, is_before);
	const auto before = std::prev(after);
	const auto i = static_cast<std::size_t>(after - poses_.begin());
	const double share = std::clamp((time - before->time) / (after->time - before->time), 0.0, 1.0);
	return covered_[i - 1] + share * (covered_[i] - covered_[i - 1]);
}

std::optional<Track::Recorded> Track::recorded_motion(const Reading& reading, double from, double to) const
{
	const auto a = at(from + reading.odometry_clock), b = at(to + reading.odometry_clock);
	if (!a || !b) return std::nullopt;
	const Eigen::Vector2d way = covered(to + reading.odometry_clock) - covered(from + reading.odometry_clock);
	return Recorded{*b - *a, std::abs(way.x()), std::abs(way.y())};
}

TPose2D as_read(const Reading& reading, const TPose2D& recorded)
{
	const double side = reading.is_odometry_mirrored ? -1 : 1;
	return {
	    reading.way_scale * recorded.x, side * reading.way_scale * recorded.y,
	    side * reading.turn_scale * wrapToPi(recorded.phi)};
}

std::optional<TPose2D> Track::motion(const Reading& reading, double from, double to) const
{
	const auto recorded = recorded_motion(reading, from, to);
	return recorded ? std::optional(as_read(reading, recorded->moved)) : std::nullopt;
}

TPose2D Track::motion_of_laser(const Reading& reading, double from, double to) const
{
	const auto robot = motion(reading, from, to);
	return robot ? (*robot + reading.laser) - reading.laser : TPose2D();
}

Eigen::MatrixXd Normal::solve(const Eigen::MatrixXd& right, double damping) const
{
	Eigen::MatrixXd damped = matrix;
	damped.diagonal() *= 1 + damping;
	return damped.llt().solve(right);
}

namespace
{
/// Adds a group of residuals to the sums. Its rows are those of poses from scan k on, then those of some globals.
/// \param group its number
template <int Size, std::size_t Globals>
void add_group(
    const Eigen::Matrix<double, Size, Size>& matrix, const Eigen::Matrix<double, Size, 1>& gradient, std::size_t k,
    const std::array<std::size_t, Globals>& globals, std::size_t group, Normal& sums)
{
	constexpr int kOfPoses = Size - static_cast<int>(Globals);
	const auto row = [&](int i)
	{
		const auto at = static_cast<std::size_t>(i);
		return static_cast<Eigen::Index>(i < kOfPoses ? kGlobals + 3 * k + at : globals[at - kOfPoses]);
	};
	for (int i = 0; i < Size; i++)
	{
		sums.gradient[row(i)] += gradient[i];
		sums.groups(row(i), static_cast<Eigen::Index>(group)) += gradient[i];
		for (int j = 0; j < Size; j++) sums.matrix(row(i), row(j)) += matrix(i, j);
	}
}
}  // namespace

std::pair<double, double> robust(double square, double bound)
{
	const double share = bound * bound / (bound * bound + square);
	return {0.5 * square * share, share * share};
}

State Problem::start(const Reading& reading) const
{
	State state{reading, {}};
	for (const FoundScan& scan : scans_)
		state.lasers.push_back(scan.laser + track_.motion_of_laser(told_, scan.time, scan.time + told_.middle()));
	return state;
}

Normal Problem::normal(const State& state)
{
	constexpr double kOffset = 0.05, kFixed = 1e-6;  // [m], [units of Unknown] standard deviations
	const auto size = static_cast<Eigen::Index>(kGlobals + 3 * scans_.size());
	Normal sums{
	    Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size),
	    Eigen::MatrixXd::Zero(size, static_cast<Eigen::Index>(2 * scans_.size()))};
	const auto add_prior = [&](std::size_t i, double deviation, double off)
	{
		const auto at = static_cast<Eigen::Index>(i);
		const double weight = std::pow(deviation, -2);
		sums.matrix(at, at) += weight;
		sums.gradient[at] += weight * off;
		sums.cost += 0.5 * weight * off * off;
	};
	for (std::size_t i = 0; i < kUnknowns; i++)
	{
		const double off =
		    difference(i, value_of(state.reading, static_cast<Unknown>(i)), told_value(told_, state.reading, i));
		const double unit = i == kWayScale ? told_.way_scale : 1;
		add_prior(i, unit * (is_free[i] ? kScales[i].before : kFixed), off);
	}
	add_prior(kUnknowns, kOffset, state.offset);
	for (std::size_t k = 0; k < scans_.size(); k++) add_walls(state, k, sums);
	for (std::size_t k = 0; k + 1 < scans_.size(); k++) add_motion(state, k, sums);
	return sums;
}

/// Returns the state after a step.
State Problem::moved(State state, const Eigen::VectorXd& step) const
{
	for (std::size_t i = 0; i < kUnknowns; i++) value_in(state.reading, i) += step[static_cast<Eigen::Index>(i)];
	state.offset += step[kUnknowns];
	for (std::size_t k = 0; k < scans_.size(); k++)
		for (std::size_t i = 0; i < 3; i++) state.lasers[k][i] += step[static_cast<Eigen::Index>(kGlobals + 3 * k + i)];
	return state;
}

double Problem::improve(State& state, int steps)
{
	constexpr double kGain = 0.01;  // [nat] below which it ends
	double damping = 1e-3;
	Normal sums = normal(state);
	for (int i = 0; i < steps; i++)
	{
		State next = moved(state, sums.solve(-sums.gradient, damping));
		Normal then = normal(next);
		const double gain = sums.cost - then.cost;
		damping = gain > 0 ? std::max(1e-6, 0.1 * damping) : 10 * damping;
		if (gain > 0) state = std::move(next), sums = std::move(then);
		if (std::abs(gain) < kGain || damping > 1e6) break;
	}
	return sums.cost;
}

Settled Problem::settle(TPose2D laser, std::size_t k)
{
	constexpr double kOff = 0.1, kOffTurn = 0.05;  // [m], [rad] of the pose
	constexpr int kSteps = 6;
	const Eigen::Vector3d weights(std::pow(kOff, -2), std::pow(kOff, -2), std::pow(kOffTurn, -2));
	const TPose2D about = laser;
	const std::vector<Point> seen = points(told_, k);
	double explained = 0;
	for (int step = 0; step < kSteps; step++)
	{
		const WallSums sums = wall_sums(laser, seen, 0, step < kSteps / 2 ? 12 : 3);
		const Eigen::Vector3d off(laser.x - about.x, laser.y - about.y, wrapToPi(laser.phi - about.phi));
		const Eigen::Vector3d gradient = sums.gradient.head<3>() + weights.cwiseProduct(off);
		Eigen::Matrix3d matrix = sums.matrix.topLeftCorner<3, 3>();
		matrix += weights.asDiagonal();
		const Eigen::Vector3d move = matrix.inverse() * gradient;
		laser = TPose2D(laser.x - move.x(), laser.y - move.y(), laser.phi - move.z());
		explained = sums.explained;
	}
	return {laser, explained};
}

bool is_motion(const std::vector<FoundScan>& scans, std::size_t k)
{
	constexpr double kLongest = 5;  // [s]
	return k + 1 < scans.size() && scans[k + 1].time - scans[k].time < kLongest;
}

std::optional<Eigen::Vector3d> Problem::motion_error(const State& state, std::size_t k, double of_poses) const
{
	const double middle = state.reading.middle();
	const auto recorded = track_.recorded_motion(state.reading, scans_[k].time + middle, scans_[k + 1].time + middle);
	if (!recorded) return std::nullopt;
	return calibration::motion_error(noise, state.reading, *recorded, state.lasers[k], state.lasers[k + 1], of_poses);
}

Eigen::Vector3d motion_error(
    const Noise& noise, const Reading& reading, const Track::Recorded& recorded, const TPose2D& from, const TPose2D& to,
    double of_poses)
{
	constexpr double kAlong = 0.05, kAcross = 0.01, kOfTurn = 0.05, kTurnOfWay = 0.02;  // [-], [-], [-], [rad/m]
	constexpr double kLeastWay = 0.005, kLeastTurn = 0.004;                             // [m], [rad]
	const TPose2D robot = as_read(reading, recorded.moved);
	const TPose2D laser = (robot + reading.laser) - reading.laser, seen = to - from;
	const double way = std::abs(reading.way_scale) * recorded.way, turn = std::abs(reading.turn_scale) * recorded.turn;
	const double of_turn = noise.turn * std::hypot(kOfTurn * turn, kTurnOfWay * way);
	const double lever = std::hypot(reading.laser.x, reading.laser.y) * of_turn;
	const double along = noise.way * kAlong * way, across = std::hypot(noise.way * kAcross * way, 0.5 * of_turn * way);
	const double direction = std::atan2(robot.y, robot.x) - reading.laser.phi;  // of the way, in the laser's frame
	const Eigen::Vector2d off(seen.x - laser.x, seen.y - laser.y), ahead(std::cos(direction), std::sin(direction));
	const auto deviation = [&](double a, double least, double b)
	{ return std::sqrt(a * a + least * least + b * b + of_poses * of_poses); };
	return {
	    ahead.dot(off) / deviation(along, kLeastWay, lever),
	    (ahead.x() * off.y() - ahead.y() * off.x()) / deviation(across, kLeastWay, lever),
	    wrapToPi(seen.phi - laser.phi) / deviation(of_turn, kLeastTurn, 0)};
}

std::optional<TPose2D> Problem::motion_off(const State& state, std::size_t k) const
{
	const double start = scans_[k].time + state.reading.middle(), end = scans_[k + 1].time + state.reading.middle();
	if (!track_.motion(state.reading, start, end)) return std::nullopt;
	return (state.lasers[k + 1] - state.lasers[k]) - track_.motion_of_laser(state.reading, start, end);
}

std::vector<Problem::Point> Problem::points(const Reading& reading, std::size_t k) const
{
	constexpr int kKnots = 8;
	constexpr double kStep = 0.01;  // [s]
	const FoundScan& scan = scans_[k];
	const double middle = scan.time + reading.middle();
	const auto laser_at = [&](double share, double duration)
	{ return track_.motion_of_laser(reading, middle, middle + (share - 0.5) * duration); };
	std::array<TPose2D, kKnots + 1> knots, later;
	for (int i = 0; i <= kKnots; i++)
	{
		knots[static_cast<std::size_t>(i)] = laser_at(static_cast<double>(i) / kKnots, reading.duration);
		later[static_cast<std::size_t>(i)] = laser_at(static_cast<double>(i) / kKnots, reading.duration + kStep);
	}
	const auto between = [](const std::array<TPose2D, kKnots + 1>& poses, double share)
	{
		const auto i = std::min<std::size_t>(kKnots - 1, static_cast<std::size_t>(share * kKnots));
		const double u = share * kKnots - static_cast<double>(i);
		const TPose2D &a = poses[i], &b = poses[i + 1];
		return TPose2D(a.x + u * (b.x - a.x), a.y + u * (b.y - a.y), a.phi + u * (b.phi - a.phi));
	};
	std::vector<Point> found;
	found.reserve(scan.returns.size());
	const auto first = static_cast<double>(scan.first_angle);
	for (const RecordedBeam& beam : scan.returns)
	{
		const double share = static_cast<double>(beam.share), range = static_cast<double>(beam.range);
		const double opening = static_cast<double>(beam.angle) - first;
		const double angle = first + reading.angle_scale * opening;
		const TPose2D laser = between(knots, share), then = between(later, share);
		const Eigen::Vector2d ahead(std::cos(laser.phi + angle), std::sin(laser.phi + angle));
		const double length = reading.range_factor * range;
		Point point;
		point.at = Eigen::Vector2d(laser.x, laser.y) + length * ahead;
		const Eigen::Vector2d left(-ahead.y(), ahead.x());
		point.derivative.col(0) =
		    (Eigen::Vector2d(then.x - laser.x, then.y - laser.y) + length * (then.phi - laser.phi) * left) / kStep;
		point.derivative.col(1) = length * opening * left;
		point.derivative.col(2) = range * ahead;
		found.push_back(point);
	}
	return found;
}

WallDistance Problem::wall_at(const TPose2D& laser, const Eigen::Vector2d& point)
{
	const auto in_map = laser.composePoint({point.x(), point.y()});
	return walls_.at(in_map.x, in_map.y);
}

Problem::WallSums Problem::wall_sums(const TPose2D& laser, const std::vector<Point>& seen, double offset, double bound)
{
	constexpr double kAtWall = 0.12;  // [m] of a return
	WallSums sums;
	Eigen::Matrix<double, 7, 1> row;
	const double all = static_cast<double>(std::max<std::size_t>(seen.size(), 1));
	const double share = std::min(1.0, noise.independent_returns / all);
	const double c = std::cos(laser.phi), s = std::sin(laser.phi);
	for (const Point& point : seen)
	{
		const double x = c * point.at.x() - s * point.at.y(), y = s * point.at.x() + c * point.at.y();
		const WallDistance wall = walls_.at(laser.x + x, laser.y + y);
		if (std::abs(wall.value) < kAtWall) sums.explained += 1 / all;
		const double error = (wall.value - offset) / noise.wall;
		const auto [cost, weight] = robust(error * error, bound);
		sums.cost += share * cost;
		const Eigen::RowVector2d toward(
		    c * wall.gradient_x + s * wall.gradient_y, c * wall.gradient_y - s * wall.gradient_x);
		row.head<3>() << wall.gradient_x, wall.gradient_y, wall.gradient_y * x - wall.gradient_x * y;
		row.segment<3>(3) = (toward * point.derivative).transpose();
		row[6] = -1;
		row /= noise.wall;
		sums.matrix += share * weight * row * row.transpose();
		sums.gradient += share * weight * error * row;
	}
	return sums;
}

void Problem::add_walls(const State& state, std::size_t k, Normal& sums)
{
	constexpr double kBound = 3;  // [standard deviations]
	const WallSums walls = wall_sums(state.lasers[k], points(state.reading, k), state.offset, kBound * noise.kernel);
	sums.cost += walls.cost;
	constexpr std::array<std::size_t, 4> kOfWalls = {kDuration, kAngleScale, kRangeFactor, kUnknowns};
	add_group(walls.matrix, walls.gradient, k, kOfWalls, k, sums);
}

void Problem::add_motion(const State& state, std::size_t k, Normal& sums) const
{
	constexpr int kColumns = 6 + 7;
	constexpr double kBound = 4;                      // [standard deviations]
	constexpr double kStep = 1e-5, kTimeStep = 0.01;  // of all units; [s], in which odometry has moved on
	constexpr std::array<std::size_t, 7> kOfMotion = {kYaw, kX, kY, kStart, kDuration, kWayScale, kTurnScale};
	if (!is_motion(k)) return;
	const double from = scans_[k].time + state.reading.middle(), to = scans_[k + 1].time + state.reading.middle();
	const auto recorded = track_.recorded_motion(state.reading, from, to);
	if (!recorded)
	{
		sums.cost += std::pow(kBound * noise.kernel, 2);  // as much as a way and a turn that contradict it
		return;
	}
	const Track::Recorded later =
	    track_.recorded_motion(state.reading, from + kTimeStep, to + kTimeStep).value_or(*recorded);
	const Eigen::Vector3d error =
	    calibration::motion_error(noise, state.reading, *recorded, state.lasers[k], state.lasers[k + 1], 0);
	const double of_duration = std::copysign(2 * kTimeStep, state.reading.duration);  // middle() has half of it
	Eigen::Matrix<double, 3, kColumns> rows;
	for (std::size_t i = 0; i < kColumns; i++)
	{
		Reading reading = state.reading;
		std::array<TPose2D, 2> lasers = {state.lasers[k], state.lasers[k + 1]};
		const std::size_t unknown = i < 6 ? kUnknowns : kOfMotion[i - 6];
		const bool is_start = unknown == kStart, is_time = is_start || unknown == kDuration;
		if (!is_time) (i < 6 ? lasers[i / 3][i % 3] : value_in(reading, unknown)) += kStep;
		const double step = is_start ? kTimeStep : is_time ? of_duration : kStep;
		const Eigen::Vector3d then =
		    calibration::motion_error(noise, reading, is_time ? later : *recorded, lasers[0], lasers[1], 0);
		rows.col(static_cast<Eigen::Index>(i)) = (then - error) / step;
	}
	Eigen::Matrix<double, kColumns, kColumns> matrix = Eigen::Matrix<double, kColumns, kColumns>::Zero();
	Eigen::Matrix<double, kColumns, 1> gradient = Eigen::Matrix<double, kColumns, 1>::Zero();
	const auto add_rows = [&](int first, int count)
	{
		const auto [cost, weight] = robust(error.segment(first, count).squaredNorm(), kBound * noise.kernel);
		sums.cost += cost;
		for (int i = first; i < first + count; i++)
		{
			matrix += weight * rows.row(i).transpose() * rows.row(i);
			gradient += weight * error[i] * rows.row(i).transpose();
		}
	};
	add_rows(0, 2);
	add_rows(2, 1);
	add_group(matrix, gradient, k, kOfMotion, scans_.size() + k, sums);
}
}  // namespace d2s1r::calibration
