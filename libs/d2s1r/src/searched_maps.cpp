// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "searched_maps.h"

#include <algorithm>
#include <cmath>

namespace d2s1r
{
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
	for (int* count : {&coarse.max_pairs, &coarse.candidates}) *count = static_cast<int>(std::ceil(effort * *count));
	coarse.overview_missing *= effort;
	coarse.margin *= std::sqrt(effort);
	return first;
}

Parameters limits_of_search(Parameters parameters, std::size_t maps)
{
	// [-] times as many as in one map. More find the true place of a recorded scan among those of eight maps somewhat
	// more often, and take longer: tests/experiments/RESULTS.md.
	constexpr std::size_t kMostTimes = 4;
	const auto times = static_cast<int>(std::min(maps, kMostTimes));
	parameters.coarse_search.max_pairs *= times;
	parameters.coarse_search.candidates *= times;
	return parameters;
}

namespace
{
/// Drops the candidates that cost more than the best one in another map by as much as none may in one search.
void drop_costly(
    std::vector<Found>& found, std::size_t maps, const Scan& scan, const CoarseSearchParameters& parameters)
{
	std::vector<double> least_in(maps, HUGE_VAL);  // [step]
	for (const auto& [readings, candidates] : found)
		for (const Candidate& candidate : candidates)
		{
			double& least = least_in[readings[candidate.reading].map];
			least = std::min(least, candidate.cost);
		}
	const auto cheapest = std::min_element(least_in.begin(), least_in.end());
	double least_elsewhere = HUGE_VAL;  // [step] in maps that are not the cheapest
	for (auto least = least_in.begin(); least != least_in.end(); ++least)
		if (least != cheapest) least_elsewhere = std::min(least_elsewhere, *least);
	const double directions = RangeProfiles::kDirections * scan.field_of_view / (2 * M_PI);
	const double margin = parameters.margin / std::sqrt(std::min(directions, static_cast<double>(scan.beams.size())));
	const auto cheapest_map = static_cast<std::size_t>(cheapest - least_in.begin());
	for (Found& here : found)
	{
		const auto is_costly = [&](const Candidate& candidate)
		{
			const bool is_in_cheapest = here.readings[candidate.reading].map == cheapest_map;
			return candidate.cost > (is_in_cheapest ? least_elsewhere : *cheapest) + margin;
		};
		here.candidates.erase(
		    std::remove_if(here.candidates.begin(), here.candidates.end(), is_costly), here.candidates.end());
	}
}
}  // namespace

std::vector<Found> candidates_in(
    const std::vector<SearchedMap>& maps, const Scan& scan, const CoarseSearchParameters& parameters)
{
	std::vector<Found> found;
	for (std::size_t number = 0;; number++)
	{
		Found here;
		std::vector<CoarseSearchIn> in;
		for (std::size_t map = 0; map < maps.size(); map++)
		{
			const auto& [index, prior, of_map] = maps[map];
			if (number >= index.readings.size()) continue;
			const auto& [profiles, field, tracer] = index.readings[number];
			in.push_back({profiles, prior, of_map.coarse_search.spacing});
			here.readings.push_back({field, tracer, of_map, prior, map});
		}
		if (in.empty()) break;
		here.candidates = coarse_search(in, scan, parameters);
		found.push_back(std::move(here));
	}
	if (maps.size() > 1) drop_costly(found, maps.size(), scan, parameters);
	return found;
}
}  // namespace d2s1r
