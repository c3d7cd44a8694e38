// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "calibration/starts.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

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

std::optional<HandEye> hand_eye(
    const Reading& reading, const std::vector<FoundScan>& scans, const Track& track, double late)
{
	using Complex = std::complex<double>;
	struct Motion
	{
		Complex seen, way, turn;  // [m], [unit of the odometry], exp(i turn) - 1
	};
	constexpr double kMostLever = 0.5, kLeast = 0.02;  // [m] of a laser, [m] of a difference
	constexpr int kRounds = 10;
	std::vector<Motion> motions;
	for (std::size_t i = 0; i + 1 < scans.size(); i++)
	{
		const auto told = track.motion(reading, scans[i].time + late, scans[i + 1].time + late);
		if (!told || !is_motion(scans, i)) continue;
		const TPose2D seen = scans[i + 1].laser - scans[i].laser;
		motions.push_back({{seen.x, seen.y}, {told->x, told->y}, std::polar(1.0, told->phi) - 1.0});
	}
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
		if (!(determinant > 0)) return std::nullopt;
		deviation = std::max(kLeast, median_of(errors)) * std::sqrt(turns / determinant);
		a = (turns * seen_by_way - both * seen_by_turn) / determinant;
		b = (ways * seen_by_turn - std::conj(both) * seen_by_way) / determinant;
	}
	const double yaw = -std::arg(a);
	const Complex at = b * std::polar(1.0, yaw);
	return HandEye{{at.real(), at.imag(), yaw}, std::abs(a), deviation, motions.size()};
}

Reading in_unit_of_ways(Reading reading, const std::vector<FoundScan>& scans, const Track& track)
{
	constexpr double kFactor = 5, kSure = 0.2;  // [-] of ways in another unit, [-] deviation of such a factor
	constexpr std::size_t kFewest = 6;          // [-] motions; one of the unknowns is two of its numbers
	const auto shown = hand_eye(reading, scans, track, 0);
	if (!shown || shown->motions < kFewest || shown->deviation > kSure * shown->way_factor) return reading;
	if (std::abs(std::log(shown->way_factor)) > std::log(kFactor)) reading.way_scale *= shown->way_factor;
	return reading;
}

double motion_cost(const Problem& problem, const State& state)
{
	constexpr double kBound = 4, kOfPoses = 0.04;  // [standard deviations], [m] [rad] of poses that were not improved
	double cost = 0;
	for (std::size_t k = 0; k + 1 < problem.scans(); k++)
	{
		if (!problem.is_motion(k)) continue;
		const auto error = problem.motion_error(state, k, kOfPoses);
		cost +=
		    error ? robust(error->head<2>().squaredNorm(), kBound).first + robust(error->z() * error->z(), kBound).first
		          : kBound * kBound;
	}
	return cost;
}

namespace
{
constexpr double kLatest = 0.25;  // [s] by which a laser may be late; more is another clock

/// Returns the most likely readings by the motions between the scans as they were found, with odometry of each clock
/// and side.
std::vector<Reading> likely_readings(
    const Problem& problem, const Reading& told, const Given& given, bool is_clock_known)
{
	constexpr double kWidest = 5, kClockStep = 0.1;  // [s]
	constexpr std::size_t kStarts = 3;
	std::vector<double> clocks = {0};
	if (!is_clock_known) clocks.insert(clocks.end(), given.clocks.begin(), given.clocks.end());
	for (int i = 1; !is_clock_known && i * kClockStep <= kWidest; i++)
		clocks.push_back(i * kClockStep), clocks.push_back(-i * kClockStep);
	const State found = problem.start(told);
	std::vector<std::pair<double, Reading>> starts;  // [nat]
	for (const double clock : clocks)
		for (const bool is_mirrored : {false, true})
		{
			if (given.is_odometry_known && (is_mirrored || (clock != 0 && given.known[kStart]))) continue;
			const bool is_of_laser = given.is_odometry_known || std::abs(clock) < kLatest;
			State state = found;
			state.reading.is_odometry_mirrored = is_mirrored;
			(is_of_laser ? state.reading.start : state.reading.odometry_clock) += clock;
			const double late = state.reading.middle() - told.middle();
			const auto shown = hand_eye(state.reading, problem.found(), problem.track(), late);
			if (shown && problem.is_free[kYaw]) state.reading.laser.phi = shown->laser.phi;
			if (shown && problem.is_free[kX]) state.reading.laser.x = shown->laser.x;
			if (shown && problem.is_free[kY]) state.reading.laser.y = shown->laser.y;
			starts.emplace_back(motion_cost(problem, state), state.reading);
		}
	std::stable_sort(starts.begin(), starts.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
	std::vector<Reading> best;
	for (const auto& [cost, start] : starts)
	{
		const auto is_near = [&, &reading = start](const Reading& other)
		{
			return reading.is_odometry_mirrored == other.is_odometry_mirrored &&
			       std::abs(reading.odometry_clock - other.odometry_clock) < 2 * kClockStep;
		};
		if (best.size() < kStarts && std::none_of(best.begin(), best.end(), is_near)) best.push_back(start);
	}
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

double refit(Problem& problem, State& state, int steps)
{
	problem.noise.kernel = 4;
	problem.improve(state, steps);
	problem.noise.kernel = 1;
	return problem.improve(state, steps);
}

Fit fit(Problem& problem, const Reading& reading)
{
	constexpr int kSteps = 8;
	Fit found{problem.start(reading), 0};
	found.cost = refit(problem, found.state, kSteps);
	return found;
}

State best_fit(Problem& problem, const Reading& told, const Given& given, bool is_clock_known)
{
	Fit best{problem.start(told), HUGE_VAL};  // which stays if no cost is a number
	const auto try_start = [&](const Reading& start)
	{
		Fit found = fit(problem, start);
		Reading& at = found.state.reading;
		const double late = at.start - told_value(told, at, kStart);
		if (!given.is_odometry_known && std::abs(late) > kLatest) at.odometry_clock += late, at.start -= late;
		const bool is_told =
		    at.is_odometry_mirrored == told.is_odometry_mirrored && at.odometry_clock == told.odometry_clock;
		if (!is_told) found.cost += kClear;
		if (found.cost < best.cost) best = std::move(found);
	};
	try_start(told);
	for (const Reading& start : likely_readings(problem, told, given, is_clock_known)) try_start(start);
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
