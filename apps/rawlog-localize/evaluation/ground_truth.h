// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPose2D.h>

#include <string>
#include <vector>

namespace d2s1r::app
{
struct TimedPose
{
	double timestamp = 0;      //!< [s] since the epoch
	mrpt::math::TPose2D pose;  //!< robot in the map frame, m and rad
};

/// The poses, in the order of the file.
using GroundTruth = std::vector<TimedPose>;

/// Reads lines "time x y phi" or "time x y z yaw pitch roll" (s, m, rad); lines that start with % or # are comments.
/// \throws UserError (kBadInput)
GroundTruth load_ground_truth(const std::string& file);
}  // namespace d2s1r::app
