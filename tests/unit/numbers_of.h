// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>

#include <vector>

namespace d2s1r::test
{
/// All that a result says, but for the times.
inline std::vector<double> numbers_of(const Localization& result)
{
	std::vector<double> numbers{
	    static_cast<double>(result.status), result.confidence, result.relative_entropy.value_or(0)};
	for (const Hypothesis& hypothesis : result.hypotheses)
	{
		numbers.insert(
		    numbers.end(), {hypothesis.pose.x(), hypothesis.pose.y(), hypothesis.pose.phi(), hypothesis.probability,
		                    hypothesis.log_likelihood.value_or(0)});
		for (int i = 0; i < 9; i++) numbers.push_back(hypothesis.covariance(i / 3, i % 3));
	}
	return numbers;
}
}  // namespace d2s1r::test
