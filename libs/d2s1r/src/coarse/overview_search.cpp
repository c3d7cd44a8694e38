// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/overview_search.h"

#include "base/simd.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace d2s1r
{
namespace
{
/// Returns the range histogram of a scan, as those of groups are.
std::array<std::uint8_t, RangeProfiles::kBins> histogram_of_scan(
    const RangeProfiles& profiles, const QuantizedScan& scan)
{
	std::vector<std::uint8_t> steps;
	for (const ReturnAt& beam : scan.returns) steps.push_back(profiles.quantize(beam.range) / 2);
	return profiles.histogram_of(steps.data(), steps.size());
}

/// Counts the beams of the scan that are missing in the range histogram of each group, up to whole blocks of groups.
/// \param missing room for them
void find_missing_beams(const RangeProfiles& profiles, const QuantizedScan& scan, std::uint8_t* missing)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	const auto histogram = histogram_of_scan(profiles, scan);
	for (std::size_t first = 0; first < profiles.groups(); first += kBlock)
		missing_beams(profiles.histograms.data() + first * RangeProfiles::kBins, histogram.data(), missing + first);
}

/// Returns the missing beams of the groups of a map.
/// \param missing of all maps
const std::uint8_t* missing_in(const ScanInMap& in, const std::vector<std::uint8_t>& missing)
{
	return missing.data() + in.first_block * RangeProfiles::kBlock;
}

/// Returns the missing beams of the groups of all maps, until it is called again by the same thread.
const std::vector<std::uint8_t>& missing_in_all(const std::vector<ScanInMap>& scans)
{
	thread_local std::vector<std::uint8_t> missing;  // kept for the next query
	missing.resize((scans.back().first_block + scans.back().allowed_groups.size()) * RangeProfiles::kBlock);
	for (const ScanInMap& in : scans)
		find_missing_beams(in.profiles, in.scan, missing.data() + in.first_block * RangeProfiles::kBlock);
	return missing;
}

/// Returns how many beams about one allowed group in kFewGroups, but not many more than kMostGroups, are at most
/// missing; it looks at a sample of the groups.
int missing_at_few(const std::vector<ScanInMap>& scans, const std::vector<std::uint8_t>& missing)
{
	constexpr std::size_t kFewGroups = 32, kMostGroups = 8192, kApart = 16;
	std::array<std::size_t, 256> count{};
	std::size_t seen = 0;
	for (const ScanInMap& in : scans)
		for (std::size_t group = 0; group < in.profiles.groups(); group += kApart)
		{
			if ((in.allowed_groups[group / RangeProfiles::kBlock] >> group % RangeProfiles::kBlock & 1) == 0) continue;
			count[missing_in(in, missing)[group]]++;
			seen++;
		}
	std::size_t most = 0;
	const std::size_t wanted = std::min((seen + kFewGroups - 1) / kFewGroups, kMostGroups / kApart);
	for (std::size_t below = count[0]; below < wanted; below += count[most]) most++;
	return static_cast<int>(most);
}

/// Returns how many beams may be missing at a group that still explains the scan as well as one that costs `least`
/// [2 steps] in the overviews: as many as that cost allows, and some by chance.
int most_missing(const ScanInMap& in, double least, const CoarseSearchParameters& parameters)
{
	const auto beams = static_cast<double>(in.scan.returns.size());
	const double allowed = beams * least / (static_cast<double>(in.overview_beams.size()) * parameters.truncation);
	const double most = allowed + parameters.overview_missing_by_chance * std::sqrt(beams);
	return static_cast<int>(std::min(255.0, most / in.profiles.directions * RangeProfiles::kWhole));
}

/// Compares a few beams with the overviews of some groups of a map at all shifts.
void compare_overviews(
    const ScanInMap& in, const std::vector<std::int32_t>& groups, int truncation, const std::function<bool()>& stop,
    CheapestPairs& cheapest)
{
	constexpr std::size_t kTogether = 32;
	constexpr std::size_t kUnasked = 512 * kTogether;  // [-] groups that take some ms, between two questions
	const auto directions = static_cast<std::size_t>(in.profiles.directions);
	const auto& beams = in.overview_beams;
	const OverviewScan few{beams.data(), beams.size(), in.profiles.directions, static_cast<std::uint8_t>(truncation)};
	const std::size_t stride = 2 * directions + RangeProfiles::kBlock;
	thread_local std::vector<std::uint8_t> kept_rows;  // for the next query
	thread_local std::vector<CheapPair> kept_pairs;
	kept_rows.resize(kTogether * stride);
	kept_pairs.resize(kTogether * directions);
	std::uint8_t* const rows = kept_rows.data();  // a local copy: each access to what a thread keeps is a call
	CheapPair* const found = kept_pairs.data();
	const auto overview_of = [&](std::size_t i)
	{ return in.profiles.overview_of(static_cast<std::size_t>(groups[i])); };
	for (std::size_t first = 0; first < groups.size(); first += kTogether)
	{
		if (first % kUnasked == 0 && stop && stop()) return;
		const std::size_t last = std::min(first + kTogether, groups.size());
		for (std::size_t i = first; i < last; i++)
		{
			std::uint8_t* const row = rows + (i - first) * stride;
			for (std::uint8_t* half : {row, row + directions}) std::copy_n(overview_of(i), directions, half);
			if (i + kTogether < groups.size()) prefetch(overview_of(i + kTogether), directions);
		}
		const std::size_t cheap = find_cheap_pairs(rows, last - first, few, cheapest.most(), found);
		for (std::size_t i = 0; i < cheap; i++)
		{
			const std::int32_t group = groups[first + found[i].row];
			if (in.allowed.allows_any({group, found[i].shift, found[i].cost}))
				cheapest.add({group + in.first_group, found[i].shift, found[i].cost});
		}
		cheapest.lower_limit();
	}
}

/// Returns the groups of a map where `least` to `most` beams are missing.
void find_groups_where_missing(
    const ScanInMap& in, const std::uint8_t* missing, int least, int most, std::vector<std::int32_t>& groups)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	groups.clear();
	for (std::size_t block = 0; block < in.allowed_groups.size(); block++)
	{
		std::uint64_t left = in.allowed_groups[block] & groups_between(missing + block * kBlock, least, most);
		for (; left != 0; left &= left - 1)
			groups.push_back(static_cast<std::int32_t>(block * kBlock) + __builtin_ctzll(left));
	}
}
}  // namespace

std::uint32_t overview_margin(const QuantizedScan& scan, const CoarseSearchParameters& parameters)
{
	const auto beams = static_cast<double>(count_overview_beams(scan, parameters.truncation));
	return static_cast<std::uint32_t>(parameters.margin * std::sqrt(beams));
}

void search_overviews(
    const std::vector<ScanInMap>& scans, const CoarseSearchParameters& parameters, std::uint32_t most_cost,
    const std::function<bool()>& stop, std::vector<Pair>& pairs)
{
	thread_local std::vector<std::int32_t> groups;  // kept for the next query
	const std::vector<std::uint8_t>& missing = missing_in_all(scans);
	CheapestPairs cheapest(
	    overview_margin(scans.front().scan, parameters), static_cast<std::size_t>(parameters.max_pairs), pairs);
	cheapest.lower_limit(most_cost + 1);
	const auto compare_where_missing = [&](const ScanInMap& in, int least, int most)
	{
		find_groups_where_missing(in, missing_in(in, missing), least, most, groups);
		compare_overviews(in, groups, parameters.truncation, stop, cheapest);
	};

	const int few = missing_at_few(scans, missing);
	for (const ScanInMap& in : scans) compare_where_missing(in, 0, few);
	if (most_cost < kAnyOverviewCost) return cheapest.drop_costly();
	const auto least = static_cast<double>(cheapest.least());
	for (const ScanInMap& in : scans)
	{
		const int most = most_missing(in, least, parameters);
		if (most > few) compare_where_missing(in, few + 1, most);
	}
	cheapest.drop_costly();
}
}  // namespace d2s1r
