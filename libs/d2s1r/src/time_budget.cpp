// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "time_budget.h"

#include <mrpt/system/CTicTac.h>

#include <algorithm>
#include <cmath>

namespace d2s1r
{
namespace
{
constexpr std::size_t kSample = 16;  //!< [-] one candidate in this many shows what one costs
constexpr double kReserve = 0.8;     //!< [-] of the time that is left is planned with
}  // namespace

Parameters with_share_of_effort(Parameters parameters, double share)
{
	auto& refinement = parameters.refinement;
	for (int* count :
	     {&refinement.max_scored, &refinement.max_refined, &refinement.max_restarted, &refinement.max_polished,
	      &refinement.max_compared})
		*count = static_cast<int>(std::ceil(share * *count));
	return parameters;
}

Parameters keep_affordable(
    double budget, std::vector<Candidate>& candidates, const Parameters& parameters,
    const std::function<void(const std::vector<Candidate>&, const Parameters&)>& judge)
{
	const std::size_t least = candidates.size() / kSample;
	if (least == 0) return parameters;
	const auto all = static_cast<double>(candidates.size()), sample = static_cast<double>(least);
	const std::vector<Candidate> first(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(least));
	const mrpt::system::CTicTac watch;
	judge(first, with_share_of_effort(parameters, sample / all));
	const double spent = 1e3 * watch.Tac();  // [ms]
	const double affordable = std::clamp(kReserve * (budget - spent) / spent * sample, sample, all);
	candidates.resize(static_cast<std::size_t>(affordable));
	return with_share_of_effort(parameters, affordable / all);
}
}  // namespace d2s1r
