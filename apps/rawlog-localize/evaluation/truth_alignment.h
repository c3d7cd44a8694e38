// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/ground_truth.h"
#include "frames/frame.h"

namespace d2s1r::app
{
/// Ground truth is interpolated between two lines that are at most so far apart [s].
inline constexpr double kGreatestGap = 0.5;

/// Ground truth by the clock of the log.
struct AlignedTruth
{
	GroundTruth lines;             //!< those of the file or, if some were interpolated, those that have a frame
	std::size_t interpolated = 0;  //!< [-] lines that were made between two of the file
	double offset = 0;             //!< [s] that the ground truth's clock is ahead of the log's; it has been taken off
};

/// Gives a pose of the ground truth to each frame that no line is within 1 ms of, but two lines at most kGreatestGap
/// apart are before and after. It looks first for the offset between the two clocks, of up to 5 s, at which the ground
/// truth fits to the poses of the localized frames; that counts only if the errors are less than half of those without.
AlignedTruth align_truth(const GroundTruth& truth, const std::vector<Frame>& frames);
}  // namespace d2s1r::app
