// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "searched_maps.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "fine/refinement.h"
#include "fine/scoring.h"

namespace d2s1r
{
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
	constexpr int kPairs = 3, kCandidates = 2;  // [-] times as many for all maps as for one
	if (maps.size() <= kMostSearched) return maps;
	CoarseSearchParameters for_all = maps.front().parameters.coarse_search;
	for_all.max_pairs *= kPairs;
	for_all.candidates *= kCandidates;
	std::vector<CoarseSearchIn> in;
	for (const SearchedMap& map : maps)
		in.push_back(
		    {map.index.readings.front().profiles, in.empty() ? for_all : map.parameters.coarse_search, map.prior});
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
