// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "calibration/verdicts.h"

#include <Eigen/Cholesky>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/starts.h"

namespace d2s1r::calibration
{
Differences differences_of(Problem& problem, const State& state, const Reading& told)
{
	constexpr double kParameters = 6;  // [-] that scans are spent on, about
	const Normal sums = problem.normal(state);
	const Eigen::MatrixXd inverse =
	    sums.solve(Eigen::MatrixXd::Identity(sums.gradient.size(), static_cast<Eigen::Index>(kUnknowns)), 0);
	const Eigen::MatrixXd moves = inverse.transpose().lazyProduct(sums.groups);
	const auto witnesses = static_cast<double>(problem.scans());
	Differences differences;
	for (std::size_t i = 0; i < kUnknowns; i++)
		differences.values[static_cast<Eigen::Index>(i)] =
		    difference(i, value_of(state.reading, static_cast<Unknown>(i)), told_value(told, state.reading, i));
	const Eigen::VectorXd spread = witnesses / std::max(1.0, witnesses - kParameters) * moves.rowwise().squaredNorm();
	const Eigen::Matrix<double, kUnknowns, kUnknowns> model = inverse.topRows(kUnknowns);
	const Eigen::Matrix<double, kUnknowns, 1> factors = (spread.array() / model.diagonal().array()).max(1.0).sqrt();
	differences.covariance = factors.asDiagonal() * model * factors.asDiagonal();
	return differences;
}

Change change_of(std::size_t i, const Unknowns& changed, const Differences& differences)
{
	const auto& [values, covariance] = differences;
	std::vector<Eigen::Index> fixed;
	for (std::size_t j = 0; j < kUnknowns; j++)
		if (j != i && !changed[j]) fixed.push_back(static_cast<Eigen::Index>(j));
	const auto at = static_cast<Eigen::Index>(i);
	if (fixed.empty()) return {values[at], std::sqrt(covariance(at, at))};
	const Eigen::MatrixXd among = covariance(fixed, fixed);
	const Eigen::VectorXd with = covariance(fixed, std::vector<Eigen::Index>{at});
	const Eigen::VectorXd weights = among.ldlt().solve(with);
	return {
	    values[at] - weights.dot(Eigen::VectorXd(values(fixed))),
	    std::sqrt(std::max(1e-18, covariance(at, at) - weights.dot(with)))};
}

double log_odds_of(const Change& change, const Scale& scale)
{
	if (std::abs(change.value) < scale.matters) return -HUGE_VAL;
	const double z = change.value / change.deviation;
	return 0.5 * z * z - std::log(scale.before / change.deviation) - scale.rare;
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
		residuals.turns.push_back(std::abs(mrpt::math::wrapToPi(off->phi)));
	}
	residuals.walls = median_of(residuals.walls_of_scans);
	residuals.way = median_of(residuals.ways);
	residuals.turn = median_of(residuals.turns);
	return residuals;
}

Wheels wheels_of(const Problem& problem, const State& state, const Residuals& left)
{
	constexpr double kMostWay = 0.2, kMostTurn = 5 * kDegree;  // [m], [rad] medians of motions that wheels measured
	constexpr double kScale = 0.1, kMostNoise = 2, kOfMotion = 0.15;  // [-], [-] of Noise, [-]; all chosen by hand
	std::vector<double> ways, turns;
	for (std::size_t k = 0; k + 1 < problem.scans(); k++)
	{
		if (!problem.is_motion(k)) continue;
		const mrpt::math::TPose2D seen = state.lasers[k + 1] - state.lasers[k];
		ways.push_back(std::hypot(seen.x, seen.y));
		turns.push_back(std::abs(mrpt::math::wrapToPi(seen.phi)));
	}
	const double most_way = std::max(kMostWay, kOfMotion * median_of(ways));
	const double most_turn = std::max(kMostTurn, kOfMotion * median_of(turns));
	const double noise = std::max(problem.noise.way, problem.noise.turn);
	return {
	    std::abs(state.reading.way_scale / problem.told().way_scale - 1) > kScale ||
	        std::abs(state.reading.turn_scale - 1) > kScale,
	    noise > kMostNoise, noise > 2 * kMostNoise || left.way > most_way || left.turn > most_turn};
}
}  // namespace d2s1r::calibration
