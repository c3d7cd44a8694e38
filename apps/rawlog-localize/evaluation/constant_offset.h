// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/accuracy.h"

#include <optional>
#include <vector>

namespace d2s1r::app
{
/// Says by what the poses that were found differ from the ground truth if it is nearly always the same.
struct ConstantOffset
{
	bool is_in_map_frame = false;  //!< else it is in the frame of the robot
	mrpt::math::TPose2D offset;  //!< found pose in the frame of the true one, or map of the truth in the map, m and rad
	std::size_t frames = 0;      //!< [-] localized frames that differ by it
	std::size_t of = 0;          //!< [-] localized frames with ground truth
};

/// Returns the offset that most localized frames have, if it is more than errors of localization are: the truth of
/// another frame of the robot, such as the laser, or in another frame than the map.
std::optional<ConstantOffset> find_constant_offset(const std::vector<Match>& matches);
}  // namespace d2s1r::app
