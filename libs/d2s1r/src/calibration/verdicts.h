// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What the least squares of a drive say of each unknown: how sure they are, and whether the messages are wrong.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <utility>

#include "calibration/drive_problem.h"

namespace d2s1r::calibration
{
/// Names unknowns: those that are changed, or are known.
using Unknowns = std::array<bool, kUnknowns>;

/// Holds by how much all unknowns together differ from what messages say, and how sure that is.
struct Differences
{
	Eigen::Matrix<double, kUnknowns, 1> values;
	Eigen::Matrix<double, kUnknowns, kUnknowns> covariance;
};

/// Returns the differences of a fit. The errors of neighbouring returns are not independent, nor are maps and odometry
/// without faults: it counts each scan and each motion as one witness (the sandwich of Huber and White), and is never
/// surer than the model.
Differences differences_of(Problem& problem, const State& state, const Reading& told);

/// Holds a change of an unknown and its standard deviation.
struct Change
{
	double value = 0, deviation = 0;
};

/// Returns the change of unknown `i` if only it and those in `changed` may differ from what is told.
Change change_of(std::size_t i, const Unknowns& changed, const Differences& differences);

/// Returns the log-odds [nat] of that change against what is told: the density ratio of Savage and Dickey. Minus
/// infinity if it differs by less than matters.
double log_odds_of(const Change& change, const Scale& scale);

/// Returns by how far a state misses the walls and the motions.
Residuals residuals_of(Problem& problem, const State& state);

/// Says how well the odometry serves to calibrate a laser by it.
struct Wheels
{
	bool are_off = false;     //!< by more than wheels are
	bool are_rough = false;   //!< with errors far above those of wheels
	bool are_absurd = false;  //!< so that no motion tells anything

	bool are_sound() const { return !are_off && !are_rough && !are_absurd; }
};
Wheels wheels_of(const Problem& problem, const State& state, const Residuals& left);
}  // namespace d2s1r::calibration
