// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "engine/searched_maps.h"

#include <algorithm>
#include <cmath>
#include <utility>

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
	for (int* most : {&coarse.max_pairs, &coarse.candidates}) *most = static_cast<int>(std::ceil(effort * *most));
	coarse.margin *= kFirstShare;
	return first;
}

Parameters limits_of_search(const std::vector<SearchedMap>& maps)
{
	// [-] times as many pairs and candidates as in one map. With more, the true place of a recorded scan is found a
	// little more often among those of eight maps, and a query takes longer: experiments/RESULTS.md has 1, 2
	// and 4.
	constexpr std::size_t kMostTimes = 2;
	const auto times = static_cast<int>(std::min(maps.size(), kMostTimes));
	Parameters parameters = maps.front().parameters;
	parameters.coarse_search.max_pairs *= times;
	parameters.coarse_search.candidates *= times;
	return parameters;
}

namespace
{
std::vector<CoarseSearchIn> readings_of(const std::vector<SearchedMap>& maps)
{
	std::vector<CoarseSearchIn> readings;
	for (const auto& [index, prior, of_map] : maps)
		readings.push_back({index.profiles, prior, of_map.coarse_search.spacing});
	return readings;
}
}  // namespace

SearchOfMaps::SearchOfMaps(const std::vector<SearchedMap>& maps, const Scan& scan, const CoarseSearchParameters& limits)
    : maps_(maps), limits_(limits), search_(readings_of(maps), scan, limits)
{
}

std::vector<Found> SearchOfMaps::found(const CoarseSearchParameters& limits)
{
	const std::vector<Candidate> candidates = search_.candidates(limits);
	double complete_below = 0;
	if (static_cast<int>(candidates.size()) >= limits.candidates)
		complete_below = candidates.back().cost;
	else if (!candidates.empty())
		complete_below = candidates.front().cost + search_.margin(limits);
	if (!candidates.empty())
		complete_below = std::min(complete_below, candidates.front().cost + margin() * search_.left_out_from());
	std::vector<Found> found;
	for (std::size_t number = 0;; number++)
	{
		Found here;
		std::vector<std::size_t> reading_of(maps_.size());  // by map
		for (std::size_t map = 0; map < maps_.size(); map++)
		{
			const auto& [index, prior, of_map] = maps_[map];
			if (number >= index.readings.size()) continue;
			const auto& [field, tracer] = index.readings[number];
			reading_of[map] = here.readings.size();
			here.readings.push_back({field, tracer, of_map, prior, map});
		}
		if (here.readings.empty()) break;
		here.complete_below = complete_below;
		for (const auto& [pose, cost, map] : candidates)
			if (number < maps_[map].index.readings.size()) here.candidates.push_back({pose, cost, reading_of[map]});
		found.push_back(std::move(here));
	}
	return found;
}
}  // namespace d2s1r
