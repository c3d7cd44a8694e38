// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Dense>
#include <d2s1r/calibration.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

#include "calibration/wall_field.h"

namespace d2s1r::calibration
{
using mrpt::math::TPose2D;
using mrpt::math::wrapToPi;

namespace
{
constexpr std::size_t kGlobals = kUnknowns + 1;  // the last one is how far [m] all returns end before the walls

/// What is known of an unknown before the drive, and what matters of it.
struct Scale
{
	double before;   //!< standard deviation before the drive
	double told;     //!< standard deviation below which the drive tells it
	double matters;  //!< least difference from the messages that is worth a change
	double rare;     //!< [nat] by which messages are wrong about it more rarely than about others
};
constexpr double kDegree = M_PI / 180;
// Units of Unknown. Differences that matter are above what recorded drives show of errors of maps and wheels.
constexpr std::array<Scale, kUnknowns> kScales = {
    {{M_PI, 3 * kDegree, 3 * kDegree, 0},
     {0.3, 0.05, 0.15, 0},
     {0.3, 0.05, 0.15, 0},
     {0.15, 0.03, 0.04, 0},
     {0.15, 0.03, 0.04, 0},
     {0.05, 0.01, 0.0065, 5},
     {0.05, 0.01, 0.03, 0},
     {0.2, 0.1, HUGE_VAL, 0},
     {0.2, 0.1, HUGE_VAL, 0}}};
constexpr double kClear = 10;  // [nat] of log-odds that contradict the messages

double& value_in(Reading& reading, std::size_t unknown)
{
	const std::array<double*, kUnknowns> values = {&reading.laser.phi,    &reading.laser.x,   &reading.laser.y,
	                                               &reading.first_beam,   &reading.duration,  &reading.angle_scale,
	                                               &reading.range_factor, &reading.way_scale, &reading.turn_scale};
	return *values[unknown];
}

double difference(std::size_t unknown, double a, double b)
{
	return unknown == kYaw ? wrapToPi(a - b) : a - b;
}

/// Where the robot was by its odometry.
class Track
{
   public:
	explicit Track(const std::vector<TimedPose>& poses) : poses_(poses) {}

	/// Returns the pose at a time [s] by the odometry's clock; no value before the first pose and after the last one.
	std::optional<TPose2D> at(double time) const
	{
		const auto after = std::lower_bound(
		    poses_.begin(), poses_.end(), time, [](const TimedPose& pose, double t) { return pose.time < t; });
		if (after == poses_.end() || (after == poses_.begin() && after->time > time)) return std::nullopt;
		if (after == poses_.begin()) return after->robot;
		const TPose2D &a = std::prev(after)->robot, &b = after->robot;
		const double share = (time - std::prev(after)->time) / (after->time - std::prev(after)->time);
		return TPose2D(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.phi + share * wrapToPi(b.phi - a.phi));
	}

	/// Returns the motion of the robot from one time [s] to another by the clock of the scans, as a reading has it.
	std::optional<TPose2D> motion(const Reading& reading, double from, double to) const
	{
		const auto a = at(from + reading.odometry_clock), b = at(to + reading.odometry_clock);
		if (!a || !b) return std::nullopt;
		const TPose2D robot = *b - *a;
		const double side = reading.is_odometry_mirrored ? -1 : 1;
		return TPose2D(
		    reading.way_scale * robot.x, side * reading.way_scale * robot.y,
		    side * reading.turn_scale * wrapToPi(robot.phi));
	}

	/// Returns the same of the laser; none where there is no odometry.
	TPose2D motion_of_laser(const Reading& reading, double from, double to) const
	{
		const auto robot = motion(reading, from, to);
		return robot ? (*robot + reading.laser) - reading.laser : TPose2D();
	}

   private:
	const std::vector<TimedPose>& poses_;
};

/// What is sought: a reading, where the laser was in the map in the middle of each scan, and how far returns end before
/// the walls.
struct State
{
	Reading reading;
	std::vector<TPose2D> lasers;
	double offset = 0;  //!< [m]
};

/// Standard deviations of what is measured. Those of the odometry are learned from the drive.
struct Noise
{
	double wall = 0.03;               //!< [m]
	double independent_returns = 25;  //!< [-] of a scan, whose neighbours hit the same wall
	double way = 1, turn = 1;         //!< [-] factors of the odometry's errors
	double kernel = 1;                //!< [-] how much wider the robust kernel is than in the end
};

/// The sums of a step of Gauss-Newton.
struct Normal
{
	Eigen::MatrixXd matrix;
	Eigen::VectorXd gradient;
	Eigen::MatrixXd groups;  //!< a column of the gradient for each scan and each motion; empty: not asked for
	double cost = 0;         //!< [nat]
};

/// Cost [nat] and weight of a residual by the kernel of Geman and McClure.
/// \param square [-] of the residual over its standard deviation \param bound [-] the same where it loses its force
std::pair<double, double> robust(double square, double bound)
{
	const double share = bound * bound / (bound * bound + square);
	return {0.5 * square * share, share * share};
}

/// The residuals of a drive, by what is sought.
class Problem
{
   public:
	Problem(const Grid& map, const Reading& told, const std::vector<FoundScan>& scans, const Track& track)
	    : walls_(map), told_(told), scans_(scans), track_(track)
	{
	}

	std::size_t size() const { return kGlobals + 3 * scans_.size(); }

	/// Says which unknowns are sought; the others stay as they are told.
	std::array<bool, kUnknowns> is_free{};
	Noise noise;

	State start(const Reading& reading) const
	{
		State state{reading, {}};
		for (const FoundScan& scan : scans_)  // as it was found, which is with the reading of the messages
			state.lasers.push_back(scan.laser + track_.motion_of_laser(told_, scan.time, scan.time + told_.middle()));
		return state;
	}

	Normal normal(const State& state, bool with_groups = false)
	{
		Normal sums;
		sums.matrix.setZero(static_cast<Eigen::Index>(size()), static_cast<Eigen::Index>(size()));
		sums.gradient.setZero(static_cast<Eigen::Index>(size()));
		if (with_groups)
			sums.groups.setZero(static_cast<Eigen::Index>(size()), static_cast<Eigen::Index>(2 * scans_.size()));
		for (std::size_t i = 0; i < kUnknowns; i++)
		{
			const double weight = is_free[i] ? std::pow(kScales[i].before, -2) : 1e12;
			const double off = difference(
			    i, value_of(state.reading, static_cast<Unknown>(i)), value_of(told_, static_cast<Unknown>(i)));
			add_prior(i, weight, off, sums);
		}
		add_prior(kUnknowns, std::pow(0.05, -2), state.offset, sums);
		for (std::size_t k = 0; k < scans_.size(); k++) add_walls(state, k, sums);
		for (std::size_t k = 0; k + 1 < scans_.size(); k++) add_motion(state, k, sums);
		return sums;
	}

	/// Returns the state after a step.
	State moved(State state, const Eigen::VectorXd& step) const
	{
		for (std::size_t i = 0; i < kUnknowns; i++) value_in(state.reading, i) += step[static_cast<Eigen::Index>(i)];
		state.offset += step[kUnknowns];
		for (std::size_t k = 0; k < scans_.size(); k++)
			for (std::size_t i = 0; i < 3; i++)
				state.lasers[k][i] += step[static_cast<Eigen::Index>(kGlobals + 3 * k + i)];
		return state;
	}

	/// Improves a state by the method of Levenberg and Marquardt. Returns its cost [nat].
	double improve(State& state, int steps)
	{
		double damping = 1e-3;
		Normal sums = normal(state);
		for (int i = 0; i < steps; i++)
		{
			Eigen::MatrixXd damped = sums.matrix;
			damped.diagonal() *= 1 + damping;
			State next = moved(state, -damped.llt().solve(sums.gradient));
			Normal then = normal(next);
			const double gain = sums.cost - then.cost;
			damping = gain > 0 ? std::max(1e-6, 0.1 * damping) : 10 * damping;
			if (gain > 0) state = std::move(next), sums = std::move(then);
			if (std::abs(gain) < 1e-3 || damping > 1e6) break;
		}
		return sums.cost;
	}

	/// Returns whether scan k is followed by another one before odometry has gone astray.
	bool is_motion(std::size_t k) const
	{
		constexpr double kLongest = 5;  // [s]
		return k + 1 < scans_.size() && scans_[k + 1].time - scans_[k].time < kLongest;
	}

	/// Returns by how many standard deviations motion k between scans, as found, differs from that of the odometry:
	/// along the way of the robot, across it, and in its turn. No value where there is no odometry.
	/// \param of_poses [m] [rad] error of the poses, beside that of the odometry
	std::optional<Eigen::Vector3d> motion_error(
	    const Reading& reading, const TPose2D& from, const TPose2D& to, std::size_t k, double of_poses = 0) const
	{
		return motion_error(reading, from, to, scans_[k].time, scans_[k + 1].time, of_poses);
	}
	std::optional<Eigen::Vector3d> motion_error(
	    const Reading& reading, const TPose2D& from, const TPose2D& to, double from_stamp, double to_stamp,
	    double of_poses) const
	{
		constexpr double kAlong = 0.05, kAcross = 0.01, kOfTurn = 0.05, kTurnOfWay = 0.02;  // [-], [-], [-], [rad/m]
		constexpr double kLeastWay = 0.005, kLeastTurn = 0.004;                             // [m], [rad]
		const auto robot = track_.motion(reading, from_stamp + reading.middle(), to_stamp + reading.middle());
		if (!robot) return std::nullopt;
		const TPose2D laser = (*robot + reading.laser) - reading.laser, seen = to - from;
		const double way = std::hypot(robot->x, robot->y), turn = std::abs(robot->phi);
		const double of_turn = noise.turn * std::hypot(kOfTurn * turn, kTurnOfWay * way);
		const double lever = std::hypot(reading.laser.x, reading.laser.y) * of_turn;
		const double along = noise.way * kAlong * way,
		             across = std::hypot(noise.way * kAcross * way, 0.5 * of_turn * way);
		const double direction =
		    std::atan2(robot->y, robot->x) - reading.laser.phi;  // of the way, in the laser's frame
		const Eigen::Vector2d off(seen.x - laser.x, seen.y - laser.y), ahead(std::cos(direction), std::sin(direction));
		const auto deviation = [&](double a, double least, double b)
		{ return std::sqrt(a * a + least * least + b * b + of_poses * of_poses); };
		return Eigen::Vector3d(
		    ahead.dot(off) / deviation(along, kLeastWay, lever),
		    (ahead.x() * off.y() - ahead.y() * off.x()) / deviation(across, kLeastWay, lever),
		    wrapToPi(seen.phi - laser.phi) / deviation(of_turn, kLeastTurn, 0));
	}

	/// Returns motion k of the laser between scans, as found, minus that by the odometry; no value without odometry.
	std::optional<TPose2D> motion_off(const State& state, std::size_t k) const
	{
		const double start = scans_[k].time + state.reading.middle(), end = scans_[k + 1].time + state.reading.middle();
		if (!track_.motion(state.reading, start, end)) return std::nullopt;
		return (state.lasers[k + 1] - state.lasers[k]) - track_.motion_of_laser(state.reading, start, end);
	}

	/// Returns where the returns of scan k are, in the frame of the laser in the middle of the scan, [m], and their
	/// derivatives by duration, angle scale and range factor.
	struct Point
	{
		Eigen::Vector2d at;
		Eigen::Matrix<double, 2, 3> derivative;
	};
	std::vector<Point> points(const Reading& reading, std::size_t k) const
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

	/// Returns the distance of a point, in the frame of the laser, from the walls, and its gradient in the map.
	WallDistance wall_at(const TPose2D& laser, const Eigen::Vector2d& point)
	{
		const auto in_map = laser.composePoint({point.x(), point.y()});
		return walls_.at(in_map.x, in_map.y);
	}

	std::size_t scans() const { return scans_.size(); }

   private:
	static void add_prior(std::size_t i, double weight, double off, Normal& sums)
	{
		const auto at = static_cast<Eigen::Index>(i);
		sums.matrix(at, at) += weight;
		sums.gradient[at] += weight * off;
		sums.cost += 0.5 * weight * off * off;
	}

	/// Adds the part of a group of residuals to the sums. \param where columns that the part stands for
	template <int N>
	static void add(
	    const Eigen::Matrix<double, N, N>& matrix, const Eigen::Matrix<double, N, 1>& gradient,
	    const std::array<Eigen::Index, N>& where, Eigen::Index group, Normal& sums)
	{
		for (int i = 0; i < N; i++)
		{
			for (int j = 0; j < N; j++) sums.matrix(where[i], where[j]) += matrix(i, j);
			sums.gradient[where[i]] += gradient[i];
			if (sums.groups.size() > 0) sums.groups(where[i], group) += gradient[i];
		}
	}

	void add_walls(const State& state, std::size_t k, Normal& sums)
	{
		constexpr double kBound = 3;  // [standard deviations]
		Eigen::Matrix<double, 7, 7> matrix = Eigen::Matrix<double, 7, 7>::Zero();
		Eigen::Matrix<double, 7, 1> gradient = Eigen::Matrix<double, 7, 1>::Zero(), row;
		const std::vector<Point> seen = points(state.reading, k);
		const double all = static_cast<double>(std::max<std::size_t>(seen.size(), 1));
		const double share = std::min(1.0, noise.independent_returns / all);
		const double c = std::cos(state.lasers[k].phi), s = std::sin(state.lasers[k].phi);
		for (const Point& point : seen)
		{
			const WallDistance wall = wall_at(state.lasers[k], point.at);
			const double error = (wall.value - state.offset) / noise.wall;
			const auto [cost, weight] = robust(error * error, kBound * noise.kernel);
			sums.cost += share * cost;
			const double x = c * point.at.x() - s * point.at.y(), y = s * point.at.x() + c * point.at.y();
			const Eigen::RowVector2d toward(
			    c * wall.gradient_x + s * wall.gradient_y, c * wall.gradient_y - s * wall.gradient_x);
			row.head<3>() << wall.gradient_x, wall.gradient_y, wall.gradient_y * x - wall.gradient_x * y;
			row.segment<3>(3) = (toward * point.derivative).transpose();
			row[6] = -1;
			row /= noise.wall;
			matrix += share * weight * row * row.transpose();
			gradient += share * weight * error * row;
		}
		const auto own = static_cast<Eigen::Index>(kGlobals + 3 * k);
		add<7>(
		    matrix, gradient, {own, own + 1, own + 2, kDuration, kAngleScale, kRangeFactor, kUnknowns},
		    static_cast<Eigen::Index>(k), sums);
	}

	void add_motion(const State& state, std::size_t k, Normal& sums)
	{
		constexpr int kColumns = 6 + 7;
		constexpr double kBound = 4, kStep = 1e-5;  // [standard deviations], of all units
		if (!is_motion(k)) return;
		constexpr std::array<Unknown, 7> kOfMotion = {kYaw, kX, kY, kFirstBeam, kDuration, kWayScale, kTurnScale};
		const auto error = motion_error(state.reading, state.lasers[k], state.lasers[k + 1], k);
		if (!error)
		{
			sums.cost += std::pow(kBound * noise.kernel, 2);  // as much as a way and a turn that contradict it
			return;
		}
		Eigen::Matrix<double, 3, kColumns> rows;
		std::array<Eigen::Index, kColumns> where{};
		for (std::size_t i = 0; i < kColumns; i++)
		{
			Reading reading = state.reading;
			std::array<TPose2D, 2> lasers = {state.lasers[k], state.lasers[k + 1]};
			const double step = i < 6 ? kStep : kTimes * kStep;
			(i < 6 ? lasers[i / 3][i % 3] : value_in(reading, kOfMotion[i - 6])) += step;
			where[i] = static_cast<Eigen::Index>(i < 6 ? kGlobals + 3 * k + i : kOfMotion[i - 6]);
			const auto then = motion_error(reading, lasers[0], lasers[1], k);
			rows.col(static_cast<Eigen::Index>(i)) = (then.value_or(*error) - *error) / step;
		}
		Eigen::Matrix<double, kColumns, kColumns> matrix = Eigen::Matrix<double, kColumns, kColumns>::Zero();
		Eigen::Matrix<double, kColumns, 1> gradient = Eigen::Matrix<double, kColumns, 1>::Zero();
		const auto add_rows = [&](int first, int count)
		{
			const auto [cost, weight] = robust(error->segment(first, count).squaredNorm(), kBound * noise.kernel);
			sums.cost += cost;
			matrix += weight * rows.middleRows(first, count).transpose() * rows.middleRows(first, count);
			gradient += weight * rows.middleRows(first, count).transpose() * error->segment(first, count);
		};
		add_rows(0, 2);
		add_rows(2, 1);
		add<kColumns>(matrix, gradient, where, static_cast<Eigen::Index>(scans_.size() + k), sums);
	}

	static constexpr double kTimes = 1000;  // [-] steps of times: 10 ms, in which odometry has moved on
	WallField walls_;
	const Reading& told_;
	const std::vector<FoundScan>& scans_;
	const Track& track_;
};
}  // namespace

TPose2D from_above(const mrpt::poses::CPose3D& pose)
{
	const auto& axes = pose.getRotationMatrix();
	return {pose.x(), pose.y(), std::atan2(axes(1, 0), axes(0, 0))};
}

FoundScan found_scan(const RangeScan& scan, const mrpt::poses::CPose3D& laser, double time, const TPose2D& robot)
{
	constexpr std::size_t kMost = 120;  // [-] returns that tell enough
	const TPose2D frame = from_above(laser);
	const double middle = from_above(scan.sensor_on_robot).phi - frame.phi;  // [rad] as seen from above
	const bool is_upside_down = scan.sensor_on_robot.getRotationMatrix()(2, 2) < 0;
	const double side = scan.right_to_left == is_upside_down ? -1 : 1;  // clockwise as seen from above
	const std::size_t beams = scan.size();
	const double last = std::max(1.0, static_cast<double>(beams) - 1);
	const auto share = [&](std::size_t i) { return static_cast<double>(i) / last; };
	const auto angle = [&](std::size_t i)
	{ return static_cast<float>(middle + side * static_cast<double>(scan.aperture) * (share(i) - 0.5)); };
	FoundScan found;
	found.time = time;
	found.first_angle = angle(0);
	found.laser = robot + frame;
	for (std::size_t i = 0; i < beams; i++)
	{
		if (i > 0 && i * kMost / beams == (i - 1) * kMost / beams) continue;
		if (scan.is_valid(i) && scan.ranges[i] > 0 && scan.ranges[i] < scan.max_range)
			found.returns.push_back({angle(i), scan.ranges[i], static_cast<float>(share(i))});
	}
	return found;
}

double value_of(const Reading& reading, Unknown unknown)
{
	Reading copy = reading;
	return value_in(copy, unknown);
}

bool Calibration::is_changed() const
{
	const auto is_changed = [](const Finding& finding) { return finding.verdict == Verdict::kChanged; };
	return odometry_log_odds > 0 || std::any_of(findings.begin(), findings.end(), is_changed);
}

namespace
{
double median_of(std::vector<double> values)
{
	if (values.empty()) return 0;
	const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
	std::nth_element(values.begin(), middle, values.end());
	return *middle;
}

/// Costs [nat] of the motions of a state: of all, and of their turns only.
std::pair<double, double> motion_costs(const Problem& problem, const State& state)
{
	constexpr double kBound = 4, kOfPoses = 0.04;  // [standard deviations], [m] [rad] of poses that were not improved
	double all = 0, turns = 0;
	for (std::size_t k = 0; k + 1 < problem.scans(); k++)
	{
		if (!problem.is_motion(k)) continue;
		const auto error = problem.motion_error(state.reading, state.lasers[k], state.lasers[k + 1], k, kOfPoses);
		const double none = 0.5 * kBound * kBound;
		turns += error ? robust(error->z() * error->z(), kBound).first : none;
		all += error ? robust(error->head<2>().squaredNorm(), kBound).first : none;
	}
	return {all + turns, turns};
}

struct Start
{
	Reading reading;
	double cost;  //!< [nat]
};

/// Returns the most likely readings by the motions between the scans as they were found, that of the messages first.
std::vector<Start> coarse_search(const Problem& problem, const Reading& told, std::vector<double> clocks)
{
	constexpr double kWidest = 5, kClockStep = 0.1, kYawStep = 5 * kDegree;  // [s], [s], [rad]
	constexpr double kOfLaser = 0.35;  // [s] by which a laser may be late; more is another clock
	constexpr std::size_t kKept = 4, kStarts = 3;
	for (int i = 1; i * kClockStep <= kWidest; i++) clocks.push_back(i * kClockStep), clocks.push_back(-i * kClockStep);
	const State found = problem.start(told);
	std::vector<Start> by_turns;
	const auto try_turns = [&](double clock, bool is_mirrored)
	{
		State state = found;
		state.reading.is_odometry_mirrored = is_mirrored;
		(std::abs(clock) < kOfLaser ? state.reading.first_beam : state.reading.odometry_clock) += clock;
		by_turns.push_back({state.reading, motion_costs(problem, state).second});
	};
	for (const double clock : clocks)
		for (const bool is_mirrored : {false, true}) try_turns(clock, is_mirrored);
	const auto is_less = [](const Start& a, const Start& b) { return a.cost < b.cost; };
	std::stable_sort(by_turns.begin(), by_turns.end(), is_less);
	by_turns.resize(std::min(kKept, by_turns.size()));
	try_turns(0, false);
	try_turns(0, true);
	std::vector<Start> starts;
	for (const Start& start : by_turns)
		for (double turn = 0; turn < 2 * M_PI; turn += kYawStep)
		{
			State state = found;
			state.reading = start.reading;
			state.reading.laser.phi = wrapToPi(told.laser.phi + turn);
			starts.push_back({state.reading, motion_costs(problem, state).first});
		}
	std::stable_sort(starts.begin(), starts.end(), is_less);
	std::vector<Start> best = {{told, motion_costs(problem, found).first}};
	for (const Start& start : starts)
	{
		const auto is_near = [&](const Start& other)
		{
			return start.reading.is_odometry_mirrored == other.reading.is_odometry_mirrored &&
			       std::abs(start.reading.odometry_clock - other.reading.odometry_clock) < 2 * kClockStep &&
			       std::abs(wrapToPi(start.reading.laser.phi - other.reading.laser.phi)) < 3 * kYawStep;
		};
		if (best.size() <= kStarts && std::none_of(best.begin(), best.end(), is_near)) best.push_back(start);
	}
	return best;
}

/// Learns from a state how large the errors of the odometry are.
void learn_noise(Problem& problem, const State& state)
{
	constexpr double kMedianOfOne = 0.67, kMedianOfTwo = 1.18;  // [standard deviations] of a normal distribution
	constexpr double kLeast = 0.3, kMost = 6;                   // [-]
	std::vector<double> ways, turns;
	for (std::size_t k = 0; k + 1 < problem.scans(); k++)
	{
		if (!problem.is_motion(k)) continue;
		const auto error = problem.motion_error(state.reading, state.lasers[k], state.lasers[k + 1], k);
		if (!error) continue;
		ways.push_back(error->head<2>().norm());
		turns.push_back(std::abs(error->z()));
	}
	if (ways.empty()) return;
	problem.noise.way = std::clamp(problem.noise.way * median_of(ways) / kMedianOfTwo, kLeast, kMost);
	problem.noise.turn = std::clamp(problem.noise.turn * median_of(turns) / kMedianOfOne, kLeast, kMost);
}

/// Fits from a start: with a wide kernel first, then with errors of the odometry as large as they are.
double fit(Problem& problem, State& state, int steps)
{
	problem.noise.kernel = 4;
	problem.improve(state, steps);
	problem.noise.kernel = 1;
	return problem.improve(state, steps);
}

/// Returns the state that fits best, of all starts.
State best_fit(Problem& problem, const Reading& told, const std::vector<double>& clocks)
{
	constexpr int kSteps = 8;
	State best;
	double least = HUGE_VAL;
	const auto try_start = [&](const Reading& reading, double handicap)
	{
		State state = problem.start(reading);
		const double cost = fit(problem, state, kSteps) + handicap;
		if (cost < least) least = cost, best = std::move(state);
	};
	const std::vector<Start> starts = coarse_search(problem, told, clocks);
	for (const Start& start : starts)
	{
		const bool is_told = start.reading.is_odometry_mirrored == told.is_odometry_mirrored &&
		                     start.reading.odometry_clock == told.odometry_clock;
		try_start(start.reading, is_told ? 0 : kClear);
	}
	const Reading with_told_sweep = best.reading;
	for (const double duration : {0.0, 0.1, -0.1, 0.2, -0.2})
	{
		if (!problem.is_free[kDuration]) break;
		Reading reading = with_told_sweep;
		reading.first_beam += 0.5 * (reading.duration - duration);
		reading.duration = duration;
		try_start(reading, 0);
	}
	for (const double factor : {0.975, 1.025})
	{
		if (!problem.is_free[kRangeFactor]) break;
		Reading reading = best.reading;
		reading.range_factor *= factor;
		try_start(reading, 0);
	}
	return best;
}

using Covariance = Eigen::Matrix<double, kUnknowns, kUnknowns>;

/// Returns the covariance of the unknowns. The errors of neighbouring returns are not independent, nor are maps and
/// odometry without faults: it counts each scan and each motion as one witness (the sandwich of Huber and White), and
/// is never below that of the model.
Covariance covariance_of(Problem& problem, const State& state)
{
	const Normal sums = problem.normal(state, true);
	const Eigen::MatrixXd inverse =
	    sums.matrix.llt().solve(Eigen::MatrixXd::Identity(sums.matrix.rows(), sums.matrix.cols()));
	const Eigen::MatrixXd moves = inverse.topRows(kUnknowns) * sums.groups;
	const auto witnesses = static_cast<double>(problem.scans());
	const Covariance spread = witnesses / std::max(1.0, witnesses - 6) * moves * moves.transpose();
	Covariance covariance = inverse.topLeftCorner(kUnknowns, kUnknowns);
	const Eigen::Matrix<double, kUnknowns, 1> factors =
	    (spread.diagonal().array() / covariance.diagonal().array()).max(1.0).sqrt();
	return factors.asDiagonal() * covariance * factors.asDiagonal();
}

/// Chooses which unknowns have to differ from what is told.
class Choice
{
   public:
	Choice(const Covariance& covariance, const Eigen::Matrix<double, kUnknowns, 1>& differences)
	    : covariance_(covariance), differences_(differences)
	{
	}

	/// Returns the log-odds [nat] of unknown `i` against what is told, if the unknowns in `changed` are not as told and
	/// all others are: the density ratio of Savage and Dickey. Minus infinity if it differs by too little to matter.
	double log_odds(std::size_t i, const std::array<bool, kUnknowns>& changed) const
	{
		const auto [change, deviation] = change_of(i, changed);
		if (std::abs(change) < kScales[i].matters) return -HUGE_VAL;
		const double z = change / deviation;
		return 0.5 * z * z - std::log(kScales[i].before / deviation) - kScales[i].rare;
	}

	/// Returns the change of unknown `i`, and its standard deviation, if only it and those in `changed` may change.
	std::pair<double, double> change_of(std::size_t i, const std::array<bool, kUnknowns>& changed) const
	{
		std::vector<Eigen::Index> fixed;
		for (std::size_t j = 0; j < kUnknowns; j++)
			if (j != i && !changed[j]) fixed.push_back(static_cast<Eigen::Index>(j));
		const auto at = static_cast<Eigen::Index>(i);
		if (fixed.empty()) return {differences_[at], std::sqrt(covariance_(at, at))};
		const Eigen::MatrixXd among = covariance_(fixed, fixed);
		const Eigen::VectorXd with = covariance_(fixed, std::vector<Eigen::Index>{at});
		const Eigen::VectorXd weights = among.ldlt().solve(with);
		return {
		    differences_[at] - weights.dot(Eigen::VectorXd(differences_(fixed))),
		    std::sqrt(std::max(1e-18, covariance_(at, at) - weights.dot(with)))};
	}

   private:
	const Covariance& covariance_;
	const Eigen::Matrix<double, kUnknowns, 1>& differences_;
};

/// Returns whether the odometry tells how the robot moved during a scan.
bool is_dense(const std::vector<TimedPose>& odometry)
{
	constexpr double kWidest = 0.25;  // [s]
	std::vector<double> steps;
	for (std::size_t i = 1; i < odometry.size(); i++) steps.push_back(odometry[i].time - odometry[i - 1].time);
	return !steps.empty() && median_of(steps) < kWidest;
}

Residuals residuals_of(Problem& problem, const State& state)
{
	Residuals residuals;
	for (std::size_t k = 0; k < problem.scans(); k++)
	{
		std::vector<double> distances;
		for (const Problem::Point& point : problem.points(state.reading, k))
			distances.push_back(std::abs(problem.wall_at(state.lasers[k], point.at).value - state.offset));
		residuals.walls_of_scans.push_back(median_of(distances));
		const auto off = problem.is_motion(k) ? problem.motion_off(state, k) : std::nullopt;
		if (!off) continue;
		residuals.ways.push_back(std::hypot(off->x, off->y));
		residuals.turns.push_back(std::abs(wrapToPi(off->phi)));
	}
	residuals.walls = median_of(residuals.walls_of_scans);
	residuals.way = median_of(residuals.ways);
	residuals.turn = median_of(residuals.turns);
	return residuals;
}
}  // namespace

Agreement agreement_of(
    const Reading& reading, const std::vector<FoundScan>& scans, const std::vector<TimedPose>& odometry)
{
	constexpr double kWay = 0.5, kTurn = 60 * kDegree, kLongest = 30;  // [m], [rad], [s] of a motion
	constexpr double kOfPoses = 0.04, kMost = 2.5;                     // [m] [rad], [standard deviations]
	constexpr double kTimes = 2, kLever = 1, kLeast = 0.3;             // [-], [m], [m] [rad]
	const Track track(odometry);
	const Grid no_map;
	Problem problem(no_map, reading, scans, track);
	problem.noise.way = 4, problem.noise.turn = 3;  // of wheels that slip
	std::size_t motions = 0;
	std::array<std::size_t, 2> votes{}, off{};  // of motions that are long enough, and of those that turn enough
	for (std::size_t i = 0; i < scans.size(); i++)
	{
		std::array<bool, 2> has_voted{};
		for (std::size_t j = i + 1; j < scans.size() && scans[j].time - scans[i].time < kLongest; j++)
		{
			const auto motion = track.motion(reading, scans[i].time, scans[j].time);
			if (!motion) continue;
			const double way = std::hypot(motion->x, motion->y), turn = std::abs(motion->phi);
			const std::array<bool, 2> may_vote = {way >= kWay && !has_voted[0], turn >= kTurn && !has_voted[1]};
			if (!may_vote[0] && !may_vote[1]) continue;
			const TPose2D seen = scans[j].laser - scans[i].laser;
			const bool is_carried = std::hypot(seen.x, seen.y) > kTimes * way + kLever * turn + kLeast ||
			                        std::abs(wrapToPi(seen.phi)) > kTimes * turn + kLeast;
			if (is_carried) break;  // or found elsewhere, which no reading explains
			const auto error =
			    problem.motion_error(reading, scans[i].laser, scans[j].laser, scans[i].time, scans[j].time, kOfPoses);
			if (!error) continue;
			motions++;
			for (std::size_t k = 0; k < votes.size(); k++)
			{
				if (!may_vote[k]) continue;
				has_voted[k] = true;
				votes[k]++;
				off[k] += error->cwiseAbs().maxCoeff() > kMost;
			}
		}
	}
	if (motions == 0) return Agreement::kNotShown;
	const bool is_contradicted = 2 * off[0] > votes[0] || 2 * off[1] > votes[1];
	return is_contradicted ? Agreement::kContradicts : Agreement::kAgrees;
}

Calibration calibrate(
    const Grid& map, const Reading& told, const std::vector<FoundScan>& scans, const std::vector<TimedPose>& odometry,
    const Known& given, const std::vector<double>& clocks)
{
	constexpr std::size_t kFewest = 6;                         // [-] scans
	constexpr double kMostWay = 0.2, kMostTurn = 5 * kDegree;  // [m], [rad] medians of motions that wheels measured
	constexpr double kWheels = 0.1, kMostError = 2, kLeastYaw = 10 * kDegree;  // [-], [-] of Noise, [rad]
	constexpr int kSteps = 15;
	Calibration result;
	result.told = result.shown = told;
	result.scans = scans.size();
	for (std::size_t i = 0; i < kUnknowns; i++)
		result.findings[i].told = result.findings[i].estimate = value_of(told, static_cast<Unknown>(i));
	if (scans.size() < kFewest) return result;
	Known known = given;
	if (!is_dense(odometry))
		known[kFirstBeam] = known[kDuration] = true;  // nothing tells how the robot moved meanwhile
	const Track track(odometry);
	Problem problem(map, told, scans, track);
	std::array<bool, kUnknowns> changed{};
	changed[kWayScale] = changed[kTurnScale] = true;  // which no message tells

	for (std::size_t i = 0; i < kUnknowns; i++) problem.is_free[i] = !known[i];
	State all = best_fit(problem, told, clocks);
	learn_noise(problem, all);
	problem.improve(all, kSteps);
	const Covariance covariance = covariance_of(problem, all);
	Eigen::Matrix<double, kUnknowns, 1> differences;
	for (std::size_t i = 0; i < kUnknowns; i++)
		differences[static_cast<Eigen::Index>(i)] =
		    difference(i, value_of(all.reading, static_cast<Unknown>(i)), value_of(told, static_cast<Unknown>(i)));
	const Choice choice(covariance, differences);
	// Odometry that is far off, or whose errors are far above those of wheels, has others by which a laser seems to
	// stand elsewhere, or to be late.
	const double error = std::max(problem.noise.way, problem.noise.turn);
	const bool is_off = std::abs(all.reading.way_scale - 1) > kWheels || std::abs(all.reading.turn_scale - 1) > kWheels;
	const Residuals left = residuals_of(problem, all);
	const bool is_wild = error > 2 * kMostError || left.way > kMostWay || left.turn > kMostTurn;
	if (is_off || error > kMostError || is_wild)
	{
		known[kX] = known[kY] = true;
		known[kYaw] = known[kYaw] || is_wild || std::abs(differences[kYaw]) < kLeastYaw;
		known[kFirstBeam] = known[kFirstBeam] || is_wild || error > kMostError;
	}
	for (;;)
	{
		std::size_t best = kUnknowns;
		double most = kClear;
		for (std::size_t i = 0; i < kUnknowns; i++)
			if (const double odds = changed[i] || known[i] ? -HUGE_VAL : choice.log_odds(i, changed); odds > most)
				best = i, most = odds;
		if (best == kUnknowns) break;
		changed[best] = true;
		result.findings[best].log_odds = most;
		result.findings[best].verdict = Verdict::kChanged;
	}

	problem.is_free = changed;
	State shown = all;
	shown.reading = told;
	shown.reading.is_odometry_mirrored = all.reading.is_odometry_mirrored;
	shown.reading.odometry_clock = all.reading.odometry_clock;
	for (std::size_t i = 0; i < kUnknowns; i++)
		if (changed[i])
			value_in(shown.reading, i) = value_of(told, static_cast<Unknown>(i)) + choice.change_of(i, changed).first;
	fit(problem, shown, kSteps);
	result.after = residuals_of(problem, shown);
	result.motions = result.after.ways.size();
	problem.is_free = {};
	problem.is_free[kWayScale] = problem.is_free[kTurnScale] = true;
	State as_told = problem.start(told);
	fit(problem, as_told, kSteps);
	result.before = residuals_of(problem, as_told);
	const bool is_other_odometry = all.reading.is_odometry_mirrored != told.is_odometry_mirrored ||
	                               all.reading.odometry_clock != told.odometry_clock;
	if (is_other_odometry)
		result.odometry_log_odds =
		    std::max(kClear, motion_costs(problem, as_told).first - motion_costs(problem, shown).first);

	result.shown = shown.reading;
	result.shown.laser.phi = wrapToPi(result.shown.laser.phi);
	for (std::size_t i = 0; i < kUnknowns; i++)
	{
		Finding& finding = result.findings[i];
		const auto at = static_cast<Eigen::Index>(i);
		finding.estimate = finding.told + differences[at];
		finding.deviation = std::sqrt(covariance(at, at));
		if (finding.verdict == Verdict::kChanged || known[i]) continue;
		finding.log_odds = std::max(0.0, choice.log_odds(i, changed));
		if (finding.deviation < kScales[i].told) finding.verdict = Verdict::kAsTold;
		for (std::size_t j = i + 1; j < kUnknowns; j++)
		{
			constexpr double kTied = 0.95;  // [-] correlation
			const auto other = static_cast<Eigen::Index>(j);
			if (std::abs(covariance(at, other)) > kTied * std::sqrt(covariance(at, at) * covariance(other, other)))
				result.pairs.emplace_back(static_cast<Unknown>(i), static_cast<Unknown>(j));
		}
	}
	if (result.shown.odometry_clock != told.odometry_clock)  // which a late laser cannot be told from
	{
		result.shown.odometry_clock += result.findings[kFirstBeam].estimate - told.first_beam;
		result.shown.first_beam = told.first_beam;
		result.findings[kFirstBeam].estimate = told.first_beam;
		result.findings[kFirstBeam].verdict = Verdict::kAsTold;
	}
	return result;
}
}  // namespace d2s1r::calibration
