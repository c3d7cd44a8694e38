// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <d2s1r/scoring.h>

namespace d2s1r
{
/// Scores refined poses, gathers them into distinct places with probabilities, and says what the scan can tell.
/// \return status, confidence and hypotheses (robot in map); times and relative entropy are the caller's
Localization decide(
    const Grid& grid, const DistanceField& field, const Scan& scan, const std::vector<RefinedPose>& poses,
    const Parameters& parameters);
}  // namespace d2s1r
