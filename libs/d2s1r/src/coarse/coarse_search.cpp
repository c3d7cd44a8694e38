// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/coarse_search.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <tuple>

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
/// Compares all beams with the profiles of all positions of the groups. It adds what is allowed, and costlier than the
/// cheapest by the margin at most.
/// \param first number of the first position of the map among those of all
/// \param most_of_all [step] cost beyond which no pair is added; it is lowered
void search_profiles(
    const MapToSearch& map, const std::vector<Pair>& of_groups, std::int32_t first_position, std::uint32_t& most_of_all,
    std::vector<Pair>& pairs)
{
	constexpr std::size_t kAhead = 16;
	const auto& [profiles, scan, parameters, allowed] = map;
	const auto directions = static_cast<std::size_t>(profiles.directions);
	const auto& first_of_group = profiles.first_of_group;
	const auto rows_of = [&, &by_position = profiles.by_position](std::size_t group)
	{ return by_position.data() + first_of_group[group] * directions; };
	const auto group_of = [&](std::size_t m) { return static_cast<std::size_t>(of_groups[m].position); };
	const auto margin =
	    static_cast<std::uint32_t>(parameters.margin * std::sqrt(static_cast<double>(scan.observed.size())));
	std::uint32_t most = most_of_all;
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
			const auto position = static_cast<std::int32_t>(first + i);
			if (costs[i] > most || !allowed.allows({position, of_groups[m].shift, costs[i]})) continue;
			most = std::min(most, costs[i] + margin);
			append({position + first_position, of_groups[m].shift, costs[i]}, pairs);
		}
	}
	most_of_all = most;
}

/// Returns whether a scan is quantized alike for two maps.
bool quantized_alike(const CoarseSearchIn& a, const CoarseSearchIn& b)
{
	const auto facts = [](const CoarseSearchIn& map)
	{
		const CoarseSearchParameters& parameters = map.parameters;
		return std::tuple(
		    map.profiles.directions, map.profiles.max_range, parameters.truncation, parameters.occluder_truncation,
		    parameters.occluder_range);
	};
	return facts(a) == facts(b);
}

/// What belongs to each map for one scan.
struct Prepared
{
	Prepared(const std::vector<CoarseSearchIn>& maps, const Scan& scan)
	{
		for (std::size_t i = 0; i < maps.size(); i++)
		{
			const auto& [profiles, parameters, prior] = maps[i];
			if (i == 0 || !quantized_alike(maps[i], maps[i - 1]))
				quantized.push_back(quantize(scan, profiles, parameters));
			allowed.emplace_back(profiles, prior, scan, parameters);
			to_search.push_back({profiles, quantized.back(), parameters, allowed.back()});
		}
	}

	std::deque<QuantizedScan> quantized;  //!< once for maps in a row for which it is the same
	std::deque<AllowedPairs> allowed;     //!< by map
	std::vector<MapToSearch> to_search;   //!< by map
};

/// Numbers the groups and positions of all maps.
struct Numbers
{
	std::vector<std::size_t> groups = {0}, positions = {0};  //!< by map, the first one; one more at the end

	explicit Numbers(const std::vector<CoarseSearchIn>& maps)
	{
		for (const CoarseSearchIn& map : maps)
		{
			groups.push_back(groups.back() + map.profiles.groups());
			positions.push_back(positions.back() + map.profiles.size());
		}
	}

	/// Returns the number of the map that the group or position `number` is of.
	static std::size_t map_of(const std::vector<std::size_t>& first, std::int32_t number)
	{
		if (first.size() == 2) return 0;
		const auto after = std::upper_bound(first.begin(), first.end(), static_cast<std::size_t>(number));
		return static_cast<std::size_t>(after - first.begin()) - 1;
	}
};

/// Returns the pairs of each map, with its own numbers of groups.
std::vector<std::vector<Pair>> pairs_by_map(const std::vector<Pair>& of_groups, const Numbers& numbers)
{
	std::vector<std::vector<Pair>> by_map(numbers.groups.size() - 1);
	for (Pair pair : of_groups)
	{
		const std::size_t map = Numbers::map_of(numbers.groups, pair.position);
		pair.position -= static_cast<std::int32_t>(numbers.groups[map]);
		by_map[map].push_back(pair);
	}
	return by_map;
}

/// Finds the cheapest pairs of position and shift of all maps, within the limits.
void find_pairs(const std::vector<MapToSearch>& maps, const Numbers& numbers, std::vector<Pair>& pairs)
{
	thread_local std::vector<Pair> of_groups;  // kept for the next query
	search_overviews(maps, of_groups);
	pairs.clear();
	std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
	if (maps.size() == 1)
		search_profiles(maps.front(), of_groups, 0, most, pairs);
	else
	{
		const auto by_map = pairs_by_map(of_groups, numbers);
		for (std::size_t map = 0; map < maps.size(); map++)
			search_profiles(maps[map], by_map[map], static_cast<std::int32_t>(numbers.positions[map]), most, pairs);
	}
	const auto costly = [=](const Pair& pair) { return pair.cost > most; };
	pairs.erase(std::remove_if(pairs.begin(), pairs.end(), costly), pairs.end());
}
}  // namespace

std::vector<std::vector<Candidate>> coarse_search(const std::vector<CoarseSearchIn>& maps, const Scan& scan)
{
	std::vector<std::vector<Candidate>> candidates(maps.size());
	const Prepared prepared(maps, scan);
	for (const QuantizedScan& quantized : prepared.quantized)
		if (quantized.exact.empty()) return candidates;
	const Numbers numbers(maps);
	thread_local std::vector<Pair> pairs;  // kept for the next query
	find_pairs(prepared.to_search, numbers, pairs);

	const CoarseSearchParameters& parameters = maps.front().parameters;
	std::size_t left = static_cast<std::size_t>(parameters.candidates);
	std::vector<std::optional<DistinctPoses>> distinct(maps.size());
	cheapest_first(
	    pairs,
	    [&](Pair pair)
	    {
		    const std::size_t map = Numbers::map_of(numbers.positions, pair.position);
		    pair.position -= static_cast<std::int32_t>(numbers.positions[map]);
		    const mrpt::math::TPose2D pose = pose_of(maps[map].profiles, pair);
		    const auto beams = static_cast<double>(prepared.to_search[map].scan.observed.size());
		    if (!distinct[map])
			    distinct[map].emplace(parameters.distinct_distance, mrpt::DEG2RAD(parameters.distinct_yaw));
		    if (!distinct[map]->add(pose)) return true;
		    candidates[map].push_back({pose, static_cast<double>(pair.cost) / beams});
		    return --left > 0;
	    });
	return candidates;
}

std::vector<Candidate> coarse_search(
    const RangeProfiles& profiles, const Scan& scan, const CoarseSearchParameters& parameters, const Prior& prior)
{
	return coarse_search({{profiles, parameters, prior}}, scan).front();
}
}  // namespace d2s1r
