// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "frame.h"

#include <mrpt/math/TPose2D.h>

#include <vector>

namespace d2s1r::app
{
/// Whether no robot drives from one pose to the other in that time: one of them is wrong, or the log jumps.
bool is_jump(const mrpt::math::TPose2D& from, const mrpt::math::TPose2D& to, double seconds);

/// The stretches of consecutive localized frames without a jump, which can be drawn as lines.
std::vector<std::vector<const Frame*>> path_pieces(const std::vector<Frame>& frames);
}  // namespace d2s1r::app
