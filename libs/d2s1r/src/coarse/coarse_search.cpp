// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/coarse_search.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <utility>

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
/// Compares all beams with the profiles of all positions of the groups of a reading. It adds what is allowed, and
/// costlier than the cheapest by the margin at most.
/// \param first_position number of the first position of the reading among those of all
/// \param most [step] cost beyond which no pair is added; it is lowered
void search_profiles(
    const ReadingToSearch& reading, const std::vector<Pair>& of_groups, std::int32_t first_position,
    std::uint32_t margin, std::uint32_t& most, std::vector<Pair>& pairs)
{
	constexpr std::size_t kAhead = 16;
	const auto& [profiles, scan, allowed] = reading;
	const auto directions = static_cast<std::size_t>(profiles.directions);
	const auto& first_of_group = profiles.first_of_group;
	const auto rows_of = [&, &by_position = profiles.by_position](std::size_t group)
	{ return by_position.data() + first_of_group[group] * directions; };
	const auto group_of = [&](std::size_t m) { return static_cast<std::size_t>(of_groups[m].position); };
	std::uint32_t limit = most;  // a local copy: bytes may alias the other
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
			if (costs[i] > limit || !allowed.allows({position, of_groups[m].shift, costs[i]})) continue;
			limit = std::min(limit, costs[i] + margin);
			append({position + first_position, of_groups[m].shift, costs[i]}, pairs);
		}
	}
	most = limit;
}

/// What belongs to each reading for one scan.
struct Prepared
{
	Prepared(const std::vector<CoarseSearchIn>& readings, const Scan& scan, const CoarseSearchParameters& parameters)
	{
		const auto steps_of = [](const RangeProfiles& profiles)
		{ return std::pair(profiles.directions, profiles.max_range); };
		for (const auto& [profiles, prior, spacing] : readings)
		{
			if (to_search.empty() || steps_of(profiles) != steps_of(to_search.back().profiles))
				quantized.push_back(quantize(scan, profiles, parameters));
			allowed.emplace_back(profiles, prior, scan, spacing);
			to_search.push_back({profiles, quantized.back(), allowed.back()});
		}
	}

	std::deque<QuantizedScan> quantized;     //!< once for readings in a row for which it is the same
	std::deque<AllowedPairs> allowed;        //!< by reading
	std::vector<ReadingToSearch> to_search;  //!< by reading
};

/// Numbers the groups and positions of all readings.
struct Numbers
{
	std::vector<std::size_t> groups = {0}, positions = {0};  //!< by reading, the first one; one more at the end

	explicit Numbers(const std::vector<CoarseSearchIn>& readings)
	{
		for (const CoarseSearchIn& reading : readings)
		{
			groups.push_back(groups.back() + reading.profiles.groups());
			positions.push_back(positions.back() + reading.profiles.size());
		}
	}

	/// Returns the number of the reading that the group or position `number` is of.
	static std::size_t reading_of(const std::vector<std::size_t>& first, std::int32_t number)
	{
		const auto after = std::upper_bound(first.begin(), first.end(), static_cast<std::size_t>(number));
		return static_cast<std::size_t>(after - first.begin()) - 1;
	}
};

/// Returns the pairs of each reading, with its own numbers of groups.
std::vector<std::vector<Pair>> pairs_by_reading(const std::vector<Pair>& of_groups, const Numbers& numbers)
{
	std::vector<std::vector<Pair>> by_reading(numbers.groups.size() - 1);
	for (Pair pair : of_groups)
	{
		const std::size_t reading = Numbers::reading_of(numbers.groups, pair.position);
		pair.position -= static_cast<std::int32_t>(numbers.groups[reading]);
		by_reading[reading].push_back(pair);
	}
	return by_reading;
}

/// Finds the cheapest pairs of position and shift of all readings, within the limits.
void find_pairs(
    const std::vector<ReadingToSearch>& readings, const Numbers& numbers, const CoarseSearchParameters& parameters,
    std::vector<Pair>& pairs)
{
	thread_local std::vector<Pair> of_groups;  // kept for the next query
	search_overviews(readings, parameters, of_groups);
	pairs.clear();
	const auto beams = static_cast<double>(readings.front().scan.observed.size());
	const auto margin = static_cast<std::uint32_t>(parameters.margin * std::sqrt(beams));
	std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
	if (readings.size() == 1)
		search_profiles(readings.front(), of_groups, 0, margin, most, pairs);
	else
	{
		const auto by_reading = pairs_by_reading(of_groups, numbers);
		for (std::size_t i = 0; i < readings.size(); i++)
			search_profiles(
			    readings[i], by_reading[i], static_cast<std::int32_t>(numbers.positions[i]), margin, most, pairs);
	}
	const auto costly = [=](const Pair& pair) { return pair.cost > most; };
	pairs.erase(std::remove_if(pairs.begin(), pairs.end(), costly), pairs.end());
}
}  // namespace

std::vector<Candidate> coarse_search(
    const std::vector<CoarseSearchIn>& readings, const Scan& scan, const CoarseSearchParameters& parameters)
{
	std::vector<Candidate> candidates;
	const Prepared prepared(readings, scan, parameters);
	if (prepared.quantized.front().exact.empty()) return candidates;
	const Numbers numbers(readings);
	thread_local std::vector<Pair> pairs;  // kept for the next query
	find_pairs(prepared.to_search, numbers, parameters, pairs);

	const auto beams = static_cast<double>(prepared.quantized.front().observed.size());
	DistinctPoses distinct(2 * parameters.spacing, distinct_yaw(readings.front().profiles));
	cheapest_first(
	    pairs,
	    [&](Pair pair)
	    {
		    const std::size_t reading = Numbers::reading_of(numbers.positions, pair.position);
		    pair.position -= static_cast<std::int32_t>(numbers.positions[reading]);
		    const mrpt::math::TPose2D pose = pose_of(readings[reading].profiles, pair);
		    if (!distinct.add(pose, reading)) return true;
		    candidates.push_back({pose, static_cast<double>(pair.cost) / beams, reading});
		    return candidates.size() < static_cast<std::size_t>(parameters.candidates);
	    });
	return candidates;
}

std::vector<Candidate> coarse_search(
    const RangeProfiles& profiles, const Scan& scan, const CoarseSearchParameters& parameters, const Prior& prior)
{
	return coarse_search({{profiles, prior, parameters.spacing}}, scan, parameters);
}
}  // namespace d2s1r
