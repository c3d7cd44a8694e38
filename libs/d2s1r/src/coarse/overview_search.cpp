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
void find_missing_beams(const RangeProfiles& profiles, const QuantizedScan& scan, std::vector<std::uint8_t>& missing)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	std::vector<std::uint8_t> steps;
	for (const int direction : scan.exact) steps.push_back(scan.least[static_cast<std::size_t>(direction)] / 2);
	const auto histogram = profiles.histogram_of(steps.data(), steps.size());
	missing.resize((profiles.groups() + kBlock - 1) / kBlock * kBlock);
	for (std::size_t first = 0; first < missing.size(); first += kBlock)
		missing_beams(
		    profiles.histograms.data() + first * RangeProfiles::kBins, histogram.data(), missing.data() + first);
}

/// Returns how many beams about one group in kFew is at most missing; it looks at a sample of the groups.
int missing_at_few(const std::vector<std::uint8_t>& missing, std::size_t groups)
{
	constexpr std::size_t kFew = 32, kApart = 16;
	std::array<std::size_t, 256> count{};
	std::size_t seen = 0;
	for (std::size_t group = 0; group < groups; group += kApart, seen++) count[missing[group]]++;
	std::size_t most = 0;
	for (std::size_t below = count[0]; below * kFew < seen; below += count[most]) most++;
	return static_cast<int>(most);
}

/// Returns how many beams may be missing at a group that still explains the scan as well as one that costs `least`
/// [2 steps] in the overviews: as many as a share of that cost allows, and some by chance.
int most_missing(
    const RangeProfiles& profiles, double beams, double least, const OverviewScan& few,
    const CoarseSearchParameters& parameters)
{
	const double allowed = beams * least / (static_cast<double>(few.count) * few.truncation);
	const double most =
	    parameters.overview_missing * allowed + parameters.overview_missing_by_chance * std::sqrt(beams);
	return static_cast<int>(std::min(255.0, most / profiles.directions * RangeProfiles::kWhole));
}

/// Compares a few beams with the overviews of some groups at all shifts.
void look_at(
    const RangeProfiles& profiles, const std::vector<std::int32_t>& groups, const OverviewScan& few,
    const AllowedPairs& allowed, CheapestPairs& cheapest)
{
	constexpr std::size_t kTogether = 32;
	const auto directions = static_cast<std::size_t>(profiles.directions);
	const std::size_t stride = 2 * directions + RangeProfiles::kBlock;
	thread_local std::vector<std::uint8_t> rows;  // kept for the next query
	thread_local std::vector<CheapPair> found;
	rows.resize(kTogether * stride);
	found.resize(kTogether * directions);
	const auto overview_of = [&](std::size_t i) { return profiles.overview_of(static_cast<std::size_t>(groups[i])); };
	for (std::size_t first = 0; first < groups.size(); first += kTogether)
	{
		const std::size_t last = std::min(first + kTogether, groups.size());
		for (std::size_t i = first; i < last; i++)
		{
			std::uint8_t* const row = rows.data() + (i - first) * stride;
			for (std::uint8_t* half : {row, row + directions}) std::copy_n(overview_of(i), directions, half);
			if (i + kTogether < groups.size()) prefetch(overview_of(i + kTogether), directions);
		}
		const std::size_t cheap = find_cheap_pairs(rows.data(), last - first, few, cheapest.most(), found.data());
		for (std::size_t i = 0; i < cheap; i++)
		{
			const Pair pair{groups[first + found[i].row], found[i].shift, found[i].cost};
			if (allowed.allows_any(pair)) cheapest.add(pair);
		}
		cheapest.lower_limit();
	}
}
}  // namespace

void search_overviews(
    const RangeProfiles& profiles, const QuantizedScan& scan, const CoarseSearchParameters& parameters,
    const AllowedPairs& allowed, std::vector<Pair>& pairs)
{
	const auto beams = overview_beams(scan, parameters.overview_truncation);
	const OverviewScan few{
	    beams.data(), beams.size(), profiles.directions, static_cast<std::uint8_t>(parameters.overview_truncation)};
	const auto all_pairs = static_cast<double>(profiles.groups()) * profiles.directions;
	const double wanted =
	    std::max(1.0, std::min(static_cast<double>(parameters.max_pairs), parameters.max_pairs_share * all_pairs));
	const double margin = parameters.overview_margin * std::sqrt(static_cast<double>(beams.size()));
	CheapestPairs cheapest(static_cast<std::uint32_t>(margin), static_cast<std::size_t>(wanted), pairs);

	thread_local std::vector<std::uint8_t> missing;  // kept for the next query
	thread_local std::vector<std::int32_t> groups;
	find_missing_beams(profiles, scan, missing);
	const std::vector<std::uint64_t> allowed_groups = allowed.groups();
	const auto look_where_missing = [&](int least, int most)
	{
		constexpr std::size_t kBlock = RangeProfiles::kBlock;
		groups.clear();
		for (std::size_t block = 0; block < allowed_groups.size(); block++)
		{
			std::uint64_t left = allowed_groups[block] & groups_between(missing.data() + block * kBlock, least, most);
			for (; left != 0; left &= left - 1)
				groups.push_back(static_cast<std::int32_t>(block * kBlock) + __builtin_ctzll(left));
		}
		look_at(profiles, groups, few, allowed, cheapest);
	};
	const int of_few = missing_at_few(missing, profiles.groups());
	look_where_missing(0, of_few);
	const int most = most_missing(
	    profiles, static_cast<double>(scan.exact.size()), static_cast<double>(cheapest.least()), few, parameters);
	if (most > of_few) look_where_missing(of_few + 1, most);
	cheapest.drop_costly();
}
}  // namespace d2s1r
