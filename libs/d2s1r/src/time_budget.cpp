// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "time_budget.h"

#include <d2s1r/hypotheses.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace d2s1r
{
namespace
{
constexpr std::size_t kSample = 16;  //!< [-] one candidate in this many shows what one costs
constexpr double kReserve = 0.8;     //!< [-] of the time that is left is planned with

Parameters for_share(Parameters parameters, double share)
{
	auto& refinement = parameters.refinement;
	refinement.promising = std::max(1, static_cast<int>(std::ceil(share * refinement.promising)));
	refinement.forked = static_cast<int>(std::ceil(share * refinement.forked));
	return parameters;
}

/// [ms] that the candidates take.
double time_of(
    const Grid& grid, const DistanceField& field, const Scan& scan, const std::vector<Candidate>& candidates,
    const Parameters& parameters)
{
	const auto start = std::chrono::steady_clock::now();
	decide(grid, field, scan, refine(field, scan, candidates, parameters.refinement), parameters);
	return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}
}  // namespace

Parameters keep_affordable(
    const Grid& grid, const DistanceField& field, const Scan& scan, double budget, std::vector<Candidate>& candidates,
    const Parameters& parameters)
{
	const std::size_t least = candidates.size() / kSample;
	if (least == 0) return parameters;
	const auto all = static_cast<double>(candidates.size()), sample = static_cast<double>(least);
	const std::vector<Candidate> first(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(least));
	const double spent = time_of(grid, field, scan, first, for_share(parameters, sample / all));
	const double affordable = std::clamp(kReserve * (budget - spent) / spent * sample, sample, all);
	candidates.resize(static_cast<std::size_t>(affordable));
	return for_share(parameters, affordable / all);
}
}  // namespace d2s1r
