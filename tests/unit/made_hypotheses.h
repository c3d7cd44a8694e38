// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Results of the localizer made by hand.
#pragma once

#include <d2s1r/motion.h>

#include <utility>
#include <vector>

namespace d2s1r::test
{
/// A hypothesis with the given standard deviations [m], [m], [rad].
inline Hypothesis hypothesis_at(
    const mrpt::poses::CPose2D& pose, double probability, const std::vector<double>& deviations = {0.05, 0.05, 0.02})
{
	Hypothesis hypothesis;
	hypothesis.pose = pose;
	hypothesis.covariance = covariance_of(deviations.at(0), deviations.at(1), deviations.at(2));
	hypothesis.probability = probability;
	return hypothesis;
}

/// \param hypotheses by decreasing probability; none: rejected
inline Localization result_of(std::vector<Hypothesis> hypotheses)
{
	if (hypotheses.empty()) return no_place(Status::kRejected, "nothing fits");
	Localization result;
	result.confidence = hypotheses[0].probability;
	result.status = result.confidence > 0.9 ? Status::kLocalized : Status::kAmbiguous;
	result.hypotheses = std::move(hypotheses);
	return result;
}

/// One hypothesis that is nearly sure.
inline Localization localized_at(const mrpt::poses::CPose2D& pose)
{
	return result_of({hypothesis_at(pose, 0.95, {0.02, 0.05, 0.01})});
}
}  // namespace d2s1r::test
