// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "engine/search_effort.h"

#include <algorithm>
#include <cmath>

namespace d2s1r
{
namespace
{
/// Share of the margin of the coarse search that the first look takes; the whole one takes longer for the same answers.
/// Chosen by hand.
constexpr double kFirstShare = 0.7;  //!< [-]
}  // namespace

Parameters with_share_of_effort(Parameters parameters, double share)
{
	int& most = parameters.refinement.max_scored;
	most = static_cast<int>(std::ceil(share * most));
	return parameters;
}

Parameters for_first_look(const Parameters& parameters)
{
	const double effort = parameters.first_look.effort;
	Parameters first = with_share_of_effort(parameters, effort);
	auto& coarse = first.coarse_search;
	for (int* most : {&coarse.max_pairs, &coarse.candidates}) *most = static_cast<int>(std::ceil(effort * *most));
	coarse.margin *= kFirstShare;
	return first;
}

Parameters limits_of_search(const std::vector<SearchedMap>& maps)
{
	// [-] times as many pairs and candidates as in one map. At 3f09be9, 1, 2 and 4 found map and pose of 92.9, 93.9 and
	// 94.3 % of 477 recorded scans among eight maps, in 9.8, 13.4 and 16.9 ms a scan.
	constexpr std::size_t kMostTimes = 2;
	const auto times = static_cast<int>(std::min(maps.size(), kMostTimes));
	Parameters parameters = maps.front().parameters;
	parameters.coarse_search.max_pairs *= times;
	parameters.coarse_search.candidates *= times;
	return parameters;
}

LeftOut left_out_of(const CandidateList& found, double cost, double margin)
{
	return cost + (1 - kFirstShare) * margin <= found.complete_below ? LeftOut::kCostly : LeftOut::kAny;
}

Parameters keep_affordable(double budget, const Parameters& parameters, const Trial& judge, CandidateList& found)
{
	constexpr std::size_t kSample = 16;  // [-] one in this many of the most candidates shows what one costs
	constexpr double kReserve = 0.8;     // [-] share of the time left that is planned with
	const std::size_t least = static_cast<std::size_t>(parameters.coarse_search.candidates) / kSample;
	if (least == 0 || found.candidates.size() <= least || std::isinf(budget)) return parameters;
	const auto all = static_cast<double>(found.candidates.size()), sample = static_cast<double>(least);
	const mrpt::system::CTicTac watch;
	judge(
	    {found.candidates.begin(), found.candidates.begin() + static_cast<std::ptrdiff_t>(least)},
	    with_share_of_effort(parameters, sample / all));
	const double spent_ms = 1e3 * watch.Tac();
	const double affordable = std::clamp(kReserve * (budget - spent_ms) / spent_ms * sample, sample, all);
	found.keep(static_cast<std::size_t>(affordable));
	return with_share_of_effort(parameters, affordable / all);
}
}  // namespace d2s1r
