// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/ground_truth.h"
#include "frames/frame.h"

#include <vector>

namespace d2s1r::app
{
struct MeanStd
{
	double mean = 0;
	double deviation = 0;  //!< of the population
};

/// NaN if there is no value.
MeanStd mean_std(const std::vector<double>& values);

/// The value below which the given share of the values lies; NaN if there is none.
/// \param share [-] in [0, 1]
double percentile(std::vector<double> values, double share);

/// How far from the truth still counts as right.
struct Tolerance
{
	double position = 0.3;  //!< [m]
	double yaw = 5.0;       //!< [deg]
};

/// A line of the ground truth and the frame of that time.
struct Match
{
	const TimedPose* truth = nullptr;
	const Frame* frame = nullptr;
	double position_error = 0;  //!< [m] of the best pose, infinite if there is none
	double yaw_error = 0;       //!< [deg] the same

	bool within(const Tolerance& tolerance) const
	{
		return position_error < tolerance.position && yaw_error < tolerance.yaw;
	}
};

/// Errors of `pose` instead of the frame's own.
Match compare(const TimedPose& truth, const Frame& frame, const mrpt::math::TPose2D& pose);

/// Pairs the lines with the frames whose time is within 1 ms; lines without a frame are left out.
std::vector<Match> match(const std::vector<Frame>& frames, const GroundTruth& truth);

/// Success, precision and errors over the matches.
struct Accuracy
{
	std::size_t frames = 0;
	std::size_t successes = 0;            //!< best pose within the tolerance, whatever the status
	std::size_t localized = 0;            //!< frames of status localized
	std::size_t localized_successes = 0;  //!< of these, within the tolerance
	MeanStd position_error;               //!< [m] over the successes
	MeanStd yaw_error;                    //!< [deg] over the successes
};

Accuracy measure(const std::vector<Match>& matches, const Tolerance& tolerance);
}  // namespace d2s1r::app
