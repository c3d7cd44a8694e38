// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <d2s1r/prior.h>
#include <d2s1r/refinement.h>

namespace d2s1r
{
/// Those of `poses` that a few beams find plausible, best score first: at most parameters.refinement.max_refined, none
/// below the best by more than parameters.refinement.score_margin. Beams are followed only where their ends
/// leave a chance. Thread-safe, as all functions here.
std::vector<RefinedPose> choose_promising(
    const BeamTracer& tracer, const DistanceField& field, const Rays& few, const std::vector<RefinedPose>& poses,
    const Parameters& parameters);

/// Scores refined poses, keeps the best of each place, and says what the scan can tell. Poses that the prior rules out
/// do not count.
///
/// A place's probability is its share of the likelihood of all places (soft maximum of their scores, tempered: the more
/// the best place leaves unexplained, the more of a difference is chance) times the probability that one of them is
/// right at all (PresenceModel: a logistic regression; what is left is the probability of none of them). Both were
/// learned from scans of eight buildings and of 17 drawn floor plans, with furniture that the plan does not have, in
/// their own and in other buildings' maps.
/// \return status, confidence and hypotheses (robot in map); times and relative entropy are the caller's
Localization decide(
    const BeamTracer& tracer, const DistanceField& field, const Scan& scan, const Rays& rays,
    const std::vector<RefinedPose>& poses, const Prior& prior, const Parameters& parameters);
}  // namespace d2s1r
