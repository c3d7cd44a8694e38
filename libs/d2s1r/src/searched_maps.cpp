// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "searched_maps.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "fine/refinement.h"
#include "fine/scoring.h"

namespace d2s1r
{
Parameters with_share_of_effort(Parameters parameters, double share)
{
	auto& refinement = parameters.refinement;
	for (int* count :
	     {&refinement.max_scored, &refinement.max_refined, &refinement.max_restarted, &refinement.max_polished,
	      &refinement.max_compared})
		*count = static_cast<int>(std::ceil(share * *count));
	return parameters;
}

Parameters for_first_look(const Parameters& parameters)
{
	const double effort = parameters.first_look.effort, margins = parameters.first_look.margins;
	Parameters first = with_share_of_effort(parameters, effort);
	auto& coarse = first.coarse_search;
	for (int* count : {&coarse.max_pairs, &coarse.candidates}) *count = static_cast<int>(std::ceil(effort * *count));
	coarse.overview_missing *= effort;
	for (double* margin : {&coarse.overview_margin, &coarse.margin}) *margin *= margins;
	return first;
}

namespace
{
/// Drops the candidates that cost more than the best one in another map by as much as none may in one map.
void drop_costly(std::vector<FoundInReading>& found, const std::vector<SearchedMap>& maps, const Scan& scan)
{
	for (FoundInReading& here : found)
	{
		double least = HUGE_VAL;  // [step] in other maps
		for (const FoundInReading& there : found)
			if (there.map != here.map && !there.candidates.empty())
				least = std::min(least, there.candidates.front().cost);
		const auto& parameters = maps[here.map].parameters.coarse_search;
		const double directions = parameters.directions * scan.field_of_view / (2 * M_PI);
		const double beams = std::min(directions, static_cast<double>(scan.beams.size()));
		const double most = least + parameters.margin / std::sqrt(beams);
		const auto kept = std::find_if(
		    here.candidates.begin(), here.candidates.end(),
		    [=](const Candidate& candidate) { return candidate.cost > most; });
		here.candidates.erase(kept, here.candidates.end());
	}
}

constexpr std::size_t kMostSearched = 8;  //!< [-] maps of an atlas that are searched as a single one is

/// Returns how well the best of the candidates in a map explains the scan [nat], by few beams; higher is better.
double promise_of(const std::vector<Candidate>& candidates, const SearchedMap& map, const BeamSubset& few)
{
	const auto& [profiles, field, tracer] = map.index.readings.front();
	double best = -HUGE_VAL;
	for (const RefinedPose& settled : settle(field, few, candidates, map.parameters.refinement))
		best =
		    std::max(best, score(tracer, field, few, settled.pose, map.parameters.scoring.beam_model).log_likelihood);
	return best;
}

}  // namespace

std::vector<SearchedMap> promising_maps(const Scan& scan, const std::vector<SearchedMap>& maps)
{
	constexpr int kTimes = 2;  // [-] times as many pairs and candidates for all maps as the first look has for one
	if (maps.size() <= kMostSearched) return maps;
	std::vector<CoarseSearchParameters> parameters;
	for (const SearchedMap& map : maps) parameters.push_back(for_first_look(map.parameters).coarse_search);
	parameters.front().max_pairs *= kTimes;
	parameters.front().candidates *= kTimes;
	std::vector<CoarseSearchIn> in;
	for (std::size_t map = 0; map < maps.size(); map++)
		in.push_back({maps[map].index.readings.front().profiles, parameters[map], maps[map].prior});
	const auto candidates = coarse_search(in, scan);
	const BeamSubset few = few_beams(scan);
	std::vector<double> promise;
	for (std::size_t map = 0; map < maps.size(); map++)
		promise.push_back(candidates[map].empty() ? -HUGE_VAL : promise_of(candidates[map], maps[map], few));
	std::vector<std::size_t> numbers(maps.size());
	std::iota(numbers.begin(), numbers.end(), std::size_t{0});
	std::stable_sort(
	    numbers.begin(), numbers.end(), [&](std::size_t a, std::size_t b) { return promise[a] > promise[b]; });
	numbers.resize(kMostSearched);
	std::sort(numbers.begin(), numbers.end());
	std::vector<SearchedMap> promising;
	for (const std::size_t number : numbers) promising.push_back(maps[number]);
	return promising;
}

std::vector<FoundInReading> candidates_in(const std::vector<SearchedMap>& maps, const Scan& scan)
{
	std::vector<FoundInReading> found;
	for (std::size_t map = 0; map < maps.size(); map++)
		for (const MapReading& reading : maps[map].index.readings)
			found.push_back(
			    {map, reading,
			     coarse_search(reading.profiles, scan, maps[map].parameters.coarse_search, maps[map].prior)});
	drop_costly(found, maps, scan);
	return found;
}
}  // namespace d2s1r
