// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/overview_search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/simd.h"

namespace d2s1r
{
namespace
{
/// Returns as many beams as a byte can sum up, spread over the scan, in an order whose beginnings are spread, too.
std::vector<OverviewBeam> overview_beams(
    const RangeProfiles& profiles, const QuantizedScan& scan, const CoarseSearchParameters& parameters)
{
	const double beside = parameters.spacing;  // [m] at most, along each axis, from the middle of a group to the sensor
	const std::size_t count = count_overview_beams(scan, parameters.truncation);
	const std::size_t stride = count % 7 != 0 ? 7 : 1;
	std::vector<OverviewBeam> beams;
	for (std::size_t i = 0; i < count; i++)
	{
		const auto& [direction, range] = scan.returns[i * stride % count * scan.returns.size() / count];
		const auto step_of = [&index = profiles](double at)
		{ return static_cast<std::uint8_t>(index.quantize(std::max(0.0, at)) / 2); };
		beams.push_back({direction, step_of(range - beside), step_of(range + beside)});
	}
	return beams;
}

/// Counts the beams of the scan that are missing in the range histogram of each group, up to whole blocks of groups.
/// \param missing room for them
void find_missing_beams(const RangeProfiles& profiles, const QuantizedScan& scan, std::uint8_t* missing)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	std::vector<std::uint8_t> steps;
	for (const ReturnAt& beam : scan.returns) steps.push_back(profiles.quantize(beam.range) / 2);
	const auto histogram = profiles.histogram_of(steps.data(), steps.size());
	for (std::size_t first = 0; first < profiles.groups(); first += kBlock)
		missing_beams(profiles.histograms.data() + first * RangeProfiles::kBins, histogram.data(), missing + first);
}

/// Returns the missing beams of the groups of a map.
/// \param missing of all maps
const std::uint8_t* missing_in(const ScanInMap& in, const std::vector<std::uint8_t>& missing)
{
	return missing.data() + in.first_block * RangeProfiles::kBlock;
}

/// Returns how many beams about one allowed group in kFew, but not many more than kMost groups, are at most missing; it
/// looks at a sample of the groups.
int missing_at_few(const std::vector<ScanInMap>& scans, const std::vector<std::uint8_t>& missing)
{
	constexpr std::size_t kFew = 32, kMost = 8192, kApart = 16;
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
	const std::size_t wanted = std::min((seen + kFew - 1) / kFew, kMost / kApart);
	for (std::size_t below = count[0]; below < wanted; below += count[most]) most++;
	return static_cast<int>(most);
}

/// Returns how many beams may be missing at a group that still explains the scan as well as one that costs `least`
/// [2 steps] in the overviews: as many as that cost allows, and some by chance.
double most_missing(const ScanInMap& in, double least, const CoarseSearchParameters& parameters)
{
	const auto beams = static_cast<double>(in.scan.returns.size());
	const double allowed = beams * least / (static_cast<double>(in.overview_beams.size()) * parameters.truncation);
	return allowed + parameters.overview_missing_by_chance * std::sqrt(beams);
}

/// Returns how many beams [-] move to another bin of the histogram between the sensor and the middle of its group, at
/// most. Near walls they are many.
double beams_that_move(const ScanInMap& in, const CoarseSearchParameters& parameters)
{
	constexpr double kBinsPerStep = (RangeProfiles::kBins - 1.0) / (RangeProfiles::kOutOfRange - 1.0);
	double moved = 0;
	for (const ReturnAt& beam : in.scan.returns)
	{
		const int steps = in.profiles.quantize(beam.range + parameters.spacing) - in.profiles.quantize(beam.range);
		moved += std::min(1.0, kBinsPerStep * steps);
	}
	return moved;
}

/// Returns `beams` [-] in the unit of missing_beams().
int in_parts(const ScanInMap& in, double beams)
{
	return static_cast<int>(std::min(255.0, beams / in.profiles.directions * RangeProfiles::kWhole));
}

/// Returns the beams that overviews are compared with, and what they may cost.
/// \param least [2 steps] of all beams, by the cheapest pair found so far
/// \param most [2 steps] of all beams
OverviewScan with_limits(const ScanInMap& in, int truncation, std::uint32_t least, std::uint32_t most)
{
	// Chosen on scans of intel, mit_killian and fr_campus: with 1.3 truncations seven true places of intel are lost.
	constexpr std::size_t kFirstBeams = 12;
	constexpr double kByChance = 1.6;  // [-] truncations, by the square root of the number of beams
	const std::size_t count = in.overview_beams.size(), few = std::min(kFirstBeams, count);
	const double expected = static_cast<double>(least * few) / static_cast<double>(count);
	const double by_chance = kByChance * std::sqrt(static_cast<double>(few)) * truncation;
	const std::uint32_t most_of_all = std::min(most, 254U);
	return {
	    in.overview_beams.data(),
	    count,
	    in.profiles.directions,
	    static_cast<std::uint8_t>(truncation),
	    few,
	    static_cast<std::uint8_t>(std::min<double>(most_of_all, expected + by_chance)),
	    static_cast<std::uint8_t>(most_of_all)};
}

/// Compares a few beams with the overviews of some groups of a map at all shifts.
/// \param most_above [2 steps] what a pair may cost more than the cheapest
void compare_overviews(
    const ScanInMap& in, const std::vector<std::int32_t>& groups, int truncation, std::uint32_t most_above,
    CheapestPairs& cheapest)
{
	constexpr std::size_t kTogether = 32;
	const auto directions = static_cast<std::size_t>(in.profiles.directions);
	const std::size_t stride = 2 * directions + RangeProfiles::kBlock;
	thread_local std::vector<std::uint8_t> rows;  // kept for the next query
	thread_local std::vector<CheapPair> found;
	rows.resize(kTogether * stride);
	found.resize(kTogether * directions);
	const auto overview_of = [&](std::size_t i)
	{ return in.profiles.overview_of(static_cast<std::size_t>(groups[i])); };
	for (std::size_t first = 0; first < groups.size(); first += kTogether)
	{
		const std::size_t last = std::min(first + kTogether, groups.size());
		for (std::size_t i = first; i < last; i++)
		{
			std::uint8_t* const row = rows.data() + (i - first) * stride;
			for (std::uint8_t* half : {row, row + directions}) std::copy_n(overview_of(i), directions, half);
			if (i + kTogether < groups.size()) prefetch(overview_of(i + kTogether), directions);
		}
		const std::uint32_t least = cheapest.least();
		const std::uint32_t most = std::min<std::uint32_t>(cheapest.most(), least + most_above);
		const OverviewScan scan = with_limits(in, truncation, least, most);
		const std::size_t cheap = find_cheap_pairs(rows.data(), last - first, scan, found.data());
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

std::size_t count_overview_beams(const QuantizedScan& scan, int truncation)
{
	return std::min(scan.returns.size(), static_cast<std::size_t>(255 / truncation));
}

std::uint32_t overview_margin(const QuantizedScan& scan, const CoarseSearchParameters& parameters)
{
	const auto beams = static_cast<double>(count_overview_beams(scan, parameters.truncation));
	return static_cast<std::uint32_t>(parameters.margin * std::sqrt(beams));
}

std::vector<ScanInMap> scan_in_maps(
    const std::vector<SearchedMap>& maps, const Scan& scan, const CoarseSearchParameters& parameters)
{
	std::vector<ScanInMap> scans;
	scans.reserve(maps.size());
	std::size_t group = 0, position = 0, block = 0;
	for (const SearchedMap& map : maps)
	{
		const RangeProfiles& profiles = map.profiles;
		QuantizedScan quantized = quantize(scan, profiles, parameters);
		auto beams = overview_beams(profiles, quantized, parameters);
		scans.push_back(
		    {profiles,
		     std::move(quantized),
		     std::move(beams),
		     {profiles, map.prior, scan, map.parameters.coarse_search.spacing}});
		scans.back().first_group = static_cast<std::int32_t>(group);
		scans.back().first_position = static_cast<std::int32_t>(position);
		scans.back().first_block = block;
		group += profiles.groups();
		position += profiles.size();
		block += scans.back().allowed_groups.size();
	}
	return scans;
}

void search_overviews(
    const std::vector<ScanInMap>& scans, const CoarseSearchParameters& parameters, std::vector<Pair>& pairs)
{
	thread_local std::vector<std::uint8_t> missing;  // of all maps; kept for the next query
	thread_local std::vector<std::int32_t> groups;   // kept for the next query
	missing.resize((scans.back().first_block + scans.back().allowed_groups.size()) * RangeProfiles::kBlock);
	for (const ScanInMap& in : scans)
		find_missing_beams(in.profiles, in.scan, missing.data() + in.first_block * RangeProfiles::kBlock);
	const std::uint32_t margin = overview_margin(scans.front().scan, parameters);
	const auto safe = static_cast<std::uint32_t>(kSafeShare * margin);
	CheapestPairs cheapest(margin, static_cast<std::size_t>(parameters.max_pairs), pairs);
	const auto compare_where_missing = [&](const ScanInMap& in, int least, int most, std::uint32_t most_above)
	{
		find_groups_where_missing(in, missing_in(in, missing), least, most, groups);
		compare_overviews(in, groups, parameters.truncation, most_above, cheapest);
	};

	const int few = missing_at_few(scans, missing);
	for (const ScanInMap& in : scans) compare_where_missing(in, 0, few, margin);
	const auto least = static_cast<double>(cheapest.least());
	for (const ScanInMap& in : scans)
	{
		const double missing_here = most_missing(in, least, parameters);
		const int most = std::max(few, in_parts(in, missing_here));
		const int most_of_equal = in_parts(in, missing_here + beams_that_move(in, parameters));
		if (most > few) compare_where_missing(in, few + 1, most, margin);
		if (most_of_equal > most) compare_where_missing(in, most + 1, most_of_equal, safe);
	}
	cheapest.drop_costly();
}
}  // namespace d2s1r
