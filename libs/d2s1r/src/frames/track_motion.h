// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <mrpt/poses/CPosePDFGaussian.h>

#include <vector>

namespace d2s1r
{
/// A Gaussian of a pose or of a motion.
using PoseDensity = mrpt::poses::CPosePDFGaussian;

/// A motion that nobody measured.
struct GuessedMotion
{
	PoseDensity motion;      //!< robot frame at its start
	double probability = 0;  //!< [0, 1] that the robot made it
};

/// Returns the motion that takes most of the hypotheses of one frame, by probability, to hypotheses of the next. If
/// there is none, its probability is 0. A motion is the more probable the more of the pairs of hypotheses share it;
/// other pairs count as jumps, and so does that the robot is at none of them.
GuessedMotion common_motion(const std::vector<Hypothesis>& from, const std::vector<Hypothesis>& to);

/// Returns the motion from the end back to the start, in the robot frame at the end.
PoseDensity reversed(const PoseDensity& motion);

/// Returns where a robot at `pose` is after `motion`, which is in its frame.
PoseDensity moved(const PoseDensity& pose, const PoseDensity& motion);
}  // namespace d2s1r
