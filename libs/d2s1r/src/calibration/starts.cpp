// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "calibration/starts.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <complex>

namespace d2s1r::calibration
{
using mrpt::math::wrapToPi;

double median_of(std::vector<double> values)
{
	if (values.empty()) return 0;
	const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
	std::nth_element(values.begin(), middle, values.end());
	return *middle;
}

Reading in_unit_of_ways(Reading reading, const std::vector<FoundScan>& scans, const Track& track)
{
	using Complex = std::complex<double>;
	struct Motion
	{
		Complex seen, way, turn;  // [m], [unit of the odometry], exp(i turn) - 1
	};
	constexpr double kMostLever = 0.5, kLeast = 0.02;  // [m] of a laser, [m] of a difference
	constexpr double kFactor = 5, kSure = 0.2;         // [-] of ways in another unit, [-] deviation of such a factor
	constexpr int kRounds = 10;
	constexpr std::size_t kFewest = 6;  // [-] motions; one of the unknowns is two of its numbers
	std::vector<Motion> motions;
	for (std::size_t i = 0; i + 1 < scans.size(); i++)
	{
		const auto told = track.motion(reading, scans[i].time, scans[i + 1].time);
		if (!told || !is_motion(scans, i)) continue;
		const TPose2D seen = scans[i + 1].laser - scans[i].laser;
		motions.push_back({{seen.x, seen.y}, {told->x, told->y}, std::polar(1.0, told->phi) - 1.0});
	}
	if (motions.size() < kFewest) return reading;
	Complex a = 0, b = 0;
	double deviation = HUGE_VAL;  // of a
	const auto off = [&](const Motion& motion) { return std::abs(motion.seen - a * motion.way - b * motion.turn); };
	for (int round = 0; round < kRounds; round++)
	{
		double ways = 0, turns = mrpt::square(kLeast / kMostLever);
		Complex both = 0, seen_by_way = 0, seen_by_turn = 0;
		std::vector<double> errors;
		for (const Motion& motion : motions)
		{
			errors.push_back(off(motion));
			const double weight = round > 0 ? kLeast / std::max(kLeast, errors.back()) : 1;
			ways += weight * std::norm(motion.way);
			turns += weight * std::norm(motion.turn);
			both += weight * std::conj(motion.way) * motion.turn;
			seen_by_way += weight * std::conj(motion.way) * motion.seen;
			seen_by_turn += weight * std::conj(motion.turn) * motion.seen;
		}
		const double determinant = ways * turns - std::norm(both);
		if (!(determinant > 0)) return reading;
		deviation = std::max(kLeast, median_of(errors)) * std::sqrt(turns / determinant);
		a = (turns * seen_by_way - both * seen_by_turn) / determinant;
		b = (ways * seen_by_turn - std::conj(both) * seen_by_way) / determinant;
	}
	const double factor = std::abs(a);
	if (deviation < kSure * factor && (factor > kFactor || factor < 1 / kFactor)) reading.way_scale *= factor;
	return reading;
}

std::pair<double, double> motion_costs(const Problem& problem, const State& state)
{
	constexpr double kBound = 4, kOfPoses = 0.04;  // [standard deviations], [m] [rad] of poses that were not improved
	double all = 0, turns = 0;
	for (std::size_t k = 0; k + 1 < problem.scans(); k++)
	{
		if (!problem.is_motion(k)) continue;
		const auto error = problem.motion_error(state, k, kOfPoses);
		const double none = 0.5 * kBound * kBound;
		turns += error ? robust(error->z() * error->z(), kBound).first : none;
		all += error ? robust(error->head<2>().squaredNorm(), kBound).first : none;
	}
	return {all + turns, turns};
}

namespace
{
constexpr double kLatest = 0.25;  // [s] by which a laser may be late; more is another clock

struct Start
{
	Reading reading;
	double cost;  //!< [nat]
};

/// Returns the most likely readings by the motions between the scans as they were found, beside that of the messages.
std::vector<Reading> likely_readings(
    const Problem& problem, const Reading& told, const Given& given, bool is_clock_known)
{
	constexpr double kWidest = 5, kClockStep = 0.1, kYawStep = 5 * kDegree;  // [s], [s], [rad]
	constexpr std::size_t kKept = 4, kStarts = 3;
	std::vector<double> clocks = given.clocks;
	for (int i = 1; i * kClockStep <= kWidest; i++) clocks.push_back(i * kClockStep), clocks.push_back(-i * kClockStep);
	const State found = problem.start(told);
	std::vector<Start> by_turns;
	const auto try_turns = [&](double clock, bool is_mirrored)
	{
		if (is_clock_known && clock != 0) return;
		if (given.is_odometry_known && (is_mirrored || (clock != 0 && given.known[kStart]))) return;
		const bool is_of_laser = given.is_odometry_known || std::abs(clock) < kLatest;
		State state = found;
		state.reading.is_odometry_mirrored = is_mirrored;
		(is_of_laser ? state.reading.start : state.reading.odometry_clock) += clock;
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
	std::vector<Reading> best = {told};
	for (const Start& start : starts)
	{
		const auto is_near = [&](const Reading& other)
		{
			return start.reading.is_odometry_mirrored == other.is_odometry_mirrored &&
			       std::abs(start.reading.odometry_clock - other.odometry_clock) < 2 * kClockStep &&
			       std::abs(wrapToPi(start.reading.laser.phi - other.laser.phi)) < 3 * kYawStep;
		};
		if (best.size() <= kStarts && std::none_of(best.begin(), best.end(), is_near)) best.push_back(start.reading);
	}
	best.erase(best.begin());
	return best;
}
}  // namespace

void learn_noise(Problem& problem, const State& state)
{
	constexpr double kMedianOfOne = 0.67, kMedianOfTwo = 1.18;  // [standard deviations] of a normal distribution
	constexpr double kLeast = 0.3, kMost = 6;                   // [-]
	std::vector<double> ways, turns;
	for (std::size_t k = 0; k + 1 < problem.scans(); k++)
	{
		if (!problem.is_motion(k)) continue;
		const auto error = problem.motion_error(state, k);
		if (!error) continue;
		ways.push_back(error->head<2>().norm());
		turns.push_back(std::abs(error->z()));
	}
	if (ways.empty()) return;
	problem.noise.way = std::clamp(problem.noise.way * median_of(ways) / kMedianOfTwo, kLeast, kMost);
	problem.noise.turn = std::clamp(problem.noise.turn * median_of(turns) / kMedianOfOne, kLeast, kMost);
}

Fit fit(Problem& problem, const Reading& reading)
{
	constexpr int kSteps = 8;
	Fit found{problem.start(reading), 0};
	found.cost = refit(problem, found.state, kSteps);
	Reading& at = found.state.reading;
	if (at.way_scale >= 0 || !problem.is_free[kYaw] || !problem.is_free[kX] || !problem.is_free[kY]) return found;
	// Ways of the other sign move a laser as these do one that is turned by 180 deg about the middle of the robot.
	at.way_scale = -at.way_scale;
	at.laser = {-at.laser.x, -at.laser.y, wrapToPi(at.laser.phi + M_PI)};
	found.cost = refit(problem, found.state, kSteps);
	return found;
}

double refit(Problem& problem, State& state, int steps)
{
	problem.noise.kernel = 4;
	problem.improve(state, steps);
	problem.noise.kernel = 1;
	return problem.improve(state, steps);
}

State best_fit(Problem& problem, const Reading& told, const Given& given, bool is_clock_known)
{
	const auto fit_from = [&](const Reading& start)
	{
		Fit found = fit(problem, start);
		Reading& at = found.state.reading;
		const double late = at.start - told_value(told, at, kStart);
		if (!given.is_odometry_known && std::abs(late) > kLatest) at.odometry_clock += late, at.start -= late;
		const bool is_told =
		    at.is_odometry_mirrored == told.is_odometry_mirrored && at.odometry_clock == told.odometry_clock;
		if (!is_told) found.cost += kClear;
		return found;
	};
	Fit best = fit_from(told);
	const auto try_start = [&](const Reading& reading)
	{
		Fit other = fit_from(reading);
		if (other.cost < best.cost) best = std::move(other);
	};
	for (const Reading& start : likely_readings(problem, told, given, is_clock_known)) try_start(start);
	const Reading with_told_sweep = best.state.reading;
	for (const double duration : {0.0, 0.1, -0.1, 0.2, -0.2})
	{
		if (!problem.is_free[kDuration]) break;
		Reading reading = with_told_sweep;
		reading.start += 0.5 * (std::abs(reading.duration) - std::abs(duration));
		reading.duration = duration;
		try_start(reading);
	}
	for (const double factor : {0.975, 1.025})
	{
		if (!problem.is_free[kRangeFactor]) break;
		Reading reading = best.state.reading;
		reading.range_factor *= factor;
		try_start(reading);
	}
	return best.state;
}
}  // namespace d2s1r::calibration
