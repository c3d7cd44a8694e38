// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "coarse/coarse_search.h"

namespace d2s1r::test
{
/// The candidates of a search through one map with these limits. Their map is not set.
inline std::vector<Candidate> coarse_search(
    const RangeProfiles& profiles, const Scan& scan, const CoarseSearchParameters& coarse, const Prior& prior = {})
{
	Parameters parameters;
	parameters.coarse_search = coarse;
	const std::vector<MapReading> none;
	const WallPatterns no_walls;
	const std::vector<SearchedMap> maps = {{profiles, none, no_walls, prior, parameters}};
	auto found = CoarseSearch(maps, scan, coarse).candidates(coarse).candidates;
	for (Candidate& candidate : found) candidate.map = nullptr;
	return found;
}
}  // namespace d2s1r::test
