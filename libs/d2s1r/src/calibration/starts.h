// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Where the least squares of a drive start, and where they end.
#pragma once

#include <optional>
#include <vector>

#include "calibration/drive_problem.h"

namespace d2s1r::calibration
{
constexpr double kClear = 10;  //!< [nat] of log-odds that contradict the messages

double median_of(std::vector<double> values);

/// Where the motions between scans show the laser, in closed form, and how far the odometry's ways are off.
struct HandEye
{
	mrpt::math::TPose2D laser;  //!< on the robot, m and rad
	double way_factor;          //!< [-]
	double deviation;           //!< [-] of way_factor
	std::size_t motions;        //!< [-] that it rests on
};

/// Returns where the motions between scans show the laser; no value if the robot does not move. One motion is enough.
/// As complex numbers, a laser at t, turned by phi, moves by a d + b (exp(i turn) - 1) if the odometry moves by d,
/// where |a| is the factor of the ways, a = |a| exp(-i phi) and b = t exp(-i phi). It minimizes Huber's loss of the
/// differences, which is quadratic up to 2 cm, with a prior of 0.5 m on b.
/// \param reading says how the odometry is read
/// \param late [s] by which scans were taken later than the messages say, with which they were found
std::optional<HandEye> hand_eye(
    const Reading& reading, const std::vector<FoundScan>& scans, const Track& track, double late);

/// Returns a reading with the unit of the odometry's ways, where six motions at least show that these are more than
/// five times too short or too long.
Reading in_unit_of_ways(Reading reading, const std::vector<FoundScan>& scans, const Track& track);

/// Returns the cost [nat] of the motions of a state.
double motion_cost(const Problem& problem, const State& state);

/// Learns from a state how large the errors of the odometry are.
void learn_noise(Problem& problem, const State& state);

/// Holds where the least squares end.
struct Fit
{
	State state;
	double cost = 0;  //!< [nat]
};

/// Fits from the scans as they were found and from a reading, with a wide kernel first.
Fit fit(Problem& problem, const Reading& reading);

/// Fits from a state, with a wide kernel first. Returns the cost [nat].
double refit(Problem& problem, State& state, int steps);

/// Returns the state that fits best, of all starts.
/// \param is_clock_known whether the odometry is of the clock of the scans
State best_fit(Problem& problem, const Reading& told, const Given& given, bool is_clock_known);
}  // namespace d2s1r::calibration
