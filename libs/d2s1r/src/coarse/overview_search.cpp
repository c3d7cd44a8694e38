// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/overview_search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/simd.h"
#include "coarse/coarse_kernel.h"

namespace d2s1r
{
namespace
{
/// Returns as many beams as a byte can sum up, spread over the scan, in an order whose beginnings are spread, too.
std::vector<OverviewBeam> overview_beams(const QuantizedScan& scan, int truncation)
{
	const std::size_t count = std::min(scan.exact.size(), static_cast<std::size_t>(255 / truncation));
	const std::size_t stride = count % 7 != 0 ? 7 : 1;
	std::vector<OverviewBeam> beams;
	for (std::size_t i = 0; i < count; i++)
	{
		const int direction = scan.exact[i * stride % count * scan.exact.size() / count];
		beams.push_back({direction, static_cast<std::uint8_t>(scan.least[static_cast<std::size_t>(direction)] / 2)});
	}
	return beams;
}

/// Counts the beams of the scan that are missing in the range histogram of each group, up to whole blocks of groups.
/// \param missing room for them
void find_missing_beams(const RangeProfiles& profiles, const QuantizedScan& scan, std::uint8_t* missing)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	std::vector<std::uint8_t> steps;
	for (const int direction : scan.exact) steps.push_back(scan.least[static_cast<std::size_t>(direction)] / 2);
	const auto histogram = profiles.histogram_of(steps.data(), steps.size());
	for (std::size_t first = 0; first < profiles.groups(); first += kBlock)
		missing_beams(profiles.histograms.data() + first * RangeProfiles::kBins, histogram.data(), missing + first);
}

/// The groups of a map among those of all.
struct GroupsOfMap
{
	const MapToSearch* map;
	std::int32_t first;     //!< [groups] number of its first one among all
	std::uint8_t* missing;  //!< by group: see find_missing_beams()
	std::vector<OverviewBeam> beams;
	OverviewScan few;
	std::vector<std::uint64_t> allowed;  //!< by block: see AllowedPairs::groups()
};

/// Returns how many beams about one group in kFew is at most missing; it looks at a sample of the groups.
int missing_at_few(const std::vector<GroupsOfMap>& maps)
{
	constexpr std::size_t kFew = 32, kApart = 16;
	std::array<std::size_t, 256> count{};
	std::size_t seen = 0;
	for (const GroupsOfMap& of : maps)
		for (std::size_t group = 0; group < of.map->profiles.groups(); group += kApart, seen++)
			count[of.missing[group]]++;
	std::size_t most = 0;
	for (std::size_t below = count[0]; below * kFew < seen; below += count[most]) most++;
	return static_cast<int>(most);
}

/// Returns how many beams may be missing at a group that still explains the scan as well as one that costs `least`
/// [2 steps] in the overviews: as many as a share of that cost allows, and some by chance.
int most_missing(const GroupsOfMap& of, double least)
{
	const CoarseSearchParameters& parameters = of.map->parameters;
	const auto beams = static_cast<double>(of.map->scan.exact.size());
	const double allowed = beams * least / (static_cast<double>(of.few.count) * of.few.truncation);
	const double most =
	    parameters.overview_missing * allowed + parameters.overview_missing_by_chance * std::sqrt(beams);
	return static_cast<int>(std::min(255.0, most / of.map->profiles.directions * RangeProfiles::kWhole));
}

/// Compares a few beams with the overviews of some groups of a map at all shifts.
void look_at(const GroupsOfMap& of, const std::vector<std::int32_t>& groups, CheapestPairs& cheapest)
{
	const auto& [profiles, scan, parameters, allowed] = *of.map;
	constexpr std::size_t kTogether = 32;
	const auto directions = static_cast<std::size_t>(profiles.directions);
	const std::size_t stride = 2 * directions + RangeProfiles::kBlock;
	thread_local std::vector<std::uint8_t> rows;  // kept for the next query
	thread_local std::vector<CheapPair> found;
	rows.resize(kTogether * stride);
	found.resize(kTogether * directions);
	const auto overview_of = [&groups, &index = profiles](std::size_t i)
	{ return index.overview_of(static_cast<std::size_t>(groups[i])); };
	for (std::size_t first = 0; first < groups.size(); first += kTogether)
	{
		const std::size_t last = std::min(first + kTogether, groups.size());
		for (std::size_t i = first; i < last; i++)
		{
			std::uint8_t* const row = rows.data() + (i - first) * stride;
			for (std::uint8_t* half : {row, row + directions}) std::copy_n(overview_of(i), directions, half);
			if (i + kTogether < groups.size()) prefetch(overview_of(i + kTogether), directions);
		}
		const std::size_t cheap = find_cheap_pairs(rows.data(), last - first, of.few, cheapest.most(), found.data());
		for (std::size_t i = 0; i < cheap; i++)
		{
			const std::int32_t group = groups[first + found[i].row];
			if (allowed.allows_any({group, found[i].shift, found[i].cost}))
				cheapest.add({group + of.first, found[i].shift, found[i].cost});
		}
		cheapest.lower_limit();
	}
}

/// Looks at the groups where `least` to `most` beams are missing.
void look_where_missing(const GroupsOfMap& of, int least, int most, CheapestPairs& cheapest)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	thread_local std::vector<std::int32_t> groups;  // kept for the next query
	groups.clear();
	for (std::size_t block = 0; block < of.allowed.size(); block++)
	{
		std::uint64_t left = of.allowed[block] & groups_between(of.missing + block * kBlock, least, most);
		for (; left != 0; left &= left - 1)
			groups.push_back(static_cast<std::int32_t>(block * kBlock) + __builtin_ctzll(left));
	}
	look_at(of, groups, cheapest);
}

/// Finds the missing beams of all groups of all maps.
/// \param missing memory for them, which is kept from query to query
std::vector<GroupsOfMap> groups_of(const std::vector<MapToSearch>& maps, std::vector<std::uint8_t>& missing)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	const auto whole_blocks = [](const MapToSearch& map)
	{ return (map.profiles.groups() + kBlock - 1) / kBlock * kBlock; };
	std::size_t size = 0;
	for (const MapToSearch& map : maps) size += whole_blocks(map);
	missing.resize(size);
	std::vector<GroupsOfMap> all;
	all.reserve(maps.size());  // beams stay where they are
	std::uint8_t* next = missing.data();
	std::size_t first = 0;
	for (const MapToSearch& map : maps)
	{
		const int truncation = map.parameters.overview_truncation;
		all.push_back(
		    {&map,
		     static_cast<std::int32_t>(first),
		     next,
		     overview_beams(map.scan, truncation),
		     {},
		     map.allowed.groups()});
		GroupsOfMap& of = all.back();
		of.few = {of.beams.data(), of.beams.size(), map.profiles.directions, static_cast<std::uint8_t>(truncation)};
		find_missing_beams(map.profiles, map.scan, of.missing);
		next += whole_blocks(map);
		first += map.profiles.groups();
	}
	return all;
}
}  // namespace

void search_overviews(const std::vector<MapToSearch>& maps, std::vector<Pair>& pairs)
{
	thread_local std::vector<std::uint8_t> missing;  // kept for the next query
	const std::vector<GroupsOfMap> all = groups_of(maps, missing);
	const CoarseSearchParameters& parameters = maps.front().parameters;
	double all_pairs = 0;
	for (const MapToSearch& map : maps)
		all_pairs += static_cast<double>(map.profiles.groups()) * map.profiles.directions;
	const double wanted =
	    std::max(1.0, std::min(static_cast<double>(parameters.max_pairs), parameters.max_pairs_share * all_pairs));
	const double margin = parameters.overview_margin * std::sqrt(static_cast<double>(all.front().beams.size()));
	CheapestPairs cheapest(static_cast<std::uint32_t>(margin), static_cast<std::size_t>(wanted), pairs);

	const int of_few = missing_at_few(all);
	for (const GroupsOfMap& of : all) look_where_missing(of, 0, of_few, cheapest);
	const auto least = static_cast<double>(cheapest.least());
	for (const GroupsOfMap& of : all)
		if (const int most = most_missing(of, least); most > of_few) look_where_missing(of, of_few + 1, most, cheapest);
	cheapest.drop_costly();
}
}  // namespace d2s1r
