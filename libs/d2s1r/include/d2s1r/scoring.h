// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/distance_field.h>
#include <d2s1r/localization.h>
#include <d2s1r/refinement.h>

namespace d2s1r
{
/// How a scan fits at one pose.
struct Score
{
	double log_likelihood = 0;  //!< [nat] against a scan that ends anywhere, higher is better
	double explained = 0;       //!< [0, 1] share of the beams with a return that end at a wall, none passed
};

/// Log-likelihood of a scan at a pose under a beam model that is honest along the whole ray: where the beam ends, how
/// many walls it passed and how much unknown space; neighbouring beams see the same object, so runs of misses count
/// too.
///
/// The weights (BeamModel) are a conditional logit: they maximize the probability of the true candidate among those
/// that coarse_search() and refine() find, so that the soft maximum of these log-likelihoods is calibrated.
Score score(
    const Grid& grid, const DistanceField& field, const Scan& scan, const mrpt::math::TPose2D& sensor,
    const BeamModel& model);
}  // namespace d2s1r
