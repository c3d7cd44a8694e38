// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/coarse_search.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "answer/distinct_poses.h"
#include "base/simd.h"
#include "coarse/allowed_pairs.h"
#include "coarse/coarse_kernel.h"
#include "coarse/coarse_pairs.h"
#include "coarse/overview_search.h"
#include "coarse/quantized_scan.h"

namespace d2s1r
{
namespace
{
/// Compares all beams with the profiles of all positions of the groups. It keeps what is allowed, and costlier than the
/// cheapest by the margin at most.
void search_profiles(
    const RangeProfiles& profiles, const QuantizedScan& scan, const CoarseSearchParameters& parameters,
    const std::vector<Pair>& of_groups, const AllowedPairs& allowed, std::vector<Pair>& pairs)
{
	constexpr std::size_t kAhead = 16;
	const auto directions = static_cast<std::size_t>(profiles.directions);
	const auto& first_of_group = profiles.first_of_group;
	const auto rows_of = [&](std::size_t group)
	{ return profiles.by_position.data() + first_of_group[group] * directions; };
	const auto group_of = [&](std::size_t m) { return static_cast<std::size_t>(of_groups[m].position); };
	const auto margin =
	    static_cast<std::uint32_t>(parameters.margin * std::sqrt(static_cast<double>(scan.observed.size())));
	std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
	pairs.clear();
	for (std::size_t m = 0; m < of_groups.size(); m++)
	{
		if (m + 2 * kAhead < of_groups.size()) __builtin_prefetch(&first_of_group[group_of(m + 2 * kAhead)]);
		if (m + kAhead < of_groups.size()) prefetch(rows_of(group_of(m + kAhead)), 4 * directions);
		const std::size_t group = group_of(m);
		const std::size_t turned = directions - static_cast<std::size_t>(of_groups[m].shift);
		const ScanRow turned_scan{
		    scan.least.data() + turned, scan.greatest.data() + turned, scan.truncation.data() + turned,
		    scan.truncation_beyond.data() + turned, directions};
		std::array<std::uint32_t, 4> costs;
		const std::size_t first = first_of_group[group], count = first_of_group[group + 1] - first;
		row_costs(rows_of(group), count, turned_scan, costs.data());
		for (std::size_t i = 0; i < count; i++)
		{
			const Pair pair{static_cast<std::int32_t>(first + i), of_groups[m].shift, costs[i]};
			if (pair.cost > most || !allowed.allows(pair)) continue;
			pairs.push_back(pair);
			most = std::min(most, pair.cost + margin);
		}
	}
	const auto costly = [=](const Pair& pair) { return pair.cost > most; };
	pairs.erase(std::remove_if(pairs.begin(), pairs.end(), costly), pairs.end());
}
}  // namespace

std::vector<Candidate> coarse_search(
    const RangeProfiles& profiles, const Scan& scan, const CoarseSearchParameters& parameters, const Prior& prior)
{
	const QuantizedScan quantized = quantize(scan, profiles, parameters);
	if (quantized.exact.empty()) return {};
	const AllowedPairs allowed(profiles, prior, scan, parameters);
	thread_local std::vector<Pair> of_groups, pairs;  // kept for the next query
	search_overviews(profiles, quantized, parameters, allowed, of_groups);
	search_profiles(profiles, quantized, parameters, of_groups, allowed, pairs);

	std::vector<Candidate> candidates;
	const auto most = static_cast<std::size_t>(parameters.candidates);
	DistinctPoses distinct(parameters.distinct_distance, mrpt::DEG2RAD(parameters.distinct_yaw));
	cheapest_first(
	    pairs,
	    [&](const Pair& pair)
	    {
		    const mrpt::math::TPose2D pose = pose_of(profiles, pair);
		    const double cost = static_cast<double>(pair.cost) / static_cast<double>(quantized.observed.size());
		    if (distinct.add(pose)) candidates.push_back({pose, cost});
		    return candidates.size() < most;
	    });
	return candidates;
}
}  // namespace d2s1r
