// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "fine/refinement.h"
#include "fine/scoring.h"

namespace d2s1r
{
/// Returns those of `poses` that a few beams find plausible, best score first: at most
/// parameters.refinement.max_refined, and none whose score is below the best one's by more than
/// parameters.refinement.score_margin. Beams are followed only where their ends leave a chance. Thread-safe.
std::vector<RefinedPose> make_shortlist(
    const BeamTracer& tracer, const DistanceField& field, const BeamSubset& few, const std::vector<RefinedPose>& poses,
    const Parameters& parameters);
}  // namespace d2s1r
