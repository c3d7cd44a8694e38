// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <mrpt/poses/CPosePDFGaussian.h>

#include <vector>

namespace d2s1r
{
/// A Gaussian of a pose or of a motion.
using PoseDensity = mrpt::poses::CPosePDFGaussian;

/// Returns the motion that takes most of the hypotheses of one frame, by probability, to hypotheses of the next. If
/// there is none, it is no motion with a large covariance.
PoseDensity common_motion(const std::vector<Hypothesis>& from, const std::vector<Hypothesis>& to);

/// Returns the motion from the end back to the start, in the robot frame at the end.
PoseDensity reversed(const PoseDensity& motion);

/// Returns where a robot at `pose` is after `motion`, which is in its frame.
PoseDensity moved(const PoseDensity& pose, const PoseDensity& motion);
}  // namespace d2s1r
