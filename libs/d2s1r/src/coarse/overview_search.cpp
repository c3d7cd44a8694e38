// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/overview_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include "base/simd.h"
#include "coarse/coarse_kernel.h"

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

/// The groups of a reading among those of all.
struct GroupsOfReading
{
	const ReadingToSearch* reading;
	std::int32_t first;                  //!< [groups] number of its first one among all
	std::uint8_t* missing;               //!< by group: see find_missing_beams()
	OverviewScan few;                    //!< beams that overviews are compared with
	std::vector<std::uint64_t> allowed;  //!< by block: see AllowedPairs::groups()
};

/// Returns how many beams about one allowed group in kFew, but not many more than kMost groups, are at most missing; it
/// looks at a sample of the groups.
int missing_at_few(const std::vector<GroupsOfReading>& readings)
{
	constexpr std::size_t kFew = 32, kMost = 8192, kApart = 16;
	std::array<std::size_t, 256> count{};
	std::size_t seen = 0;
	for (const GroupsOfReading& of : readings)
		for (std::size_t group = 0; group < of.reading->profiles.groups(); group += kApart)
		{
			if ((of.allowed[group / RangeProfiles::kBlock] >> group % RangeProfiles::kBlock & 1) == 0) continue;
			count[of.missing[group]]++;
			seen++;
		}
	std::size_t most = 0;
	const std::size_t wanted = std::min((seen + kFew - 1) / kFew, kMost / kApart);
	for (std::size_t below = count[0]; below < wanted; below += count[most]) most++;
	return static_cast<int>(most);
}

/// Returns how many beams may be missing at a group that still explains the scan as well as one that costs `least`
/// [2 steps] in the overviews: as many as that cost allows, and some by chance.
int most_missing(const GroupsOfReading& of, double least, const CoarseSearchParameters& parameters)
{
	const auto beams = static_cast<double>(of.reading->scan.returns.size());
	const double allowed = beams * least / (static_cast<double>(of.few.count) * of.few.truncation);
	const double most = allowed + parameters.overview_missing_by_chance * std::sqrt(beams);
	return static_cast<int>(std::min(255.0, most / of.reading->profiles.directions * RangeProfiles::kWhole));
}

/// Compares a few beams with the overviews of some groups of a reading at all shifts.
void look_at(const GroupsOfReading& of, const std::vector<std::int32_t>& groups, CheapestPairs& cheapest)
{
	const auto& [profiles, scan, allowed] = *of.reading;
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
void look_where_missing(const GroupsOfReading& of, int least, int most, CheapestPairs& cheapest)
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

/// Returns the beams that overviews are compared with, once for readings in a row with the same quantized scan.
std::deque<std::vector<OverviewBeam>> few_beams_of(
    const std::vector<ReadingToSearch>& readings, const CoarseSearchParameters& parameters)
{
	std::deque<std::vector<OverviewBeam>> beams;
	for (std::size_t i = 0; i < readings.size(); i++)
		if (i == 0 || &readings[i].scan != &readings[i - 1].scan)
			beams.push_back(overview_beams(readings[i].profiles, readings[i].scan, parameters));
	return beams;
}

/// Finds the missing beams of all groups of all readings.
/// \param few see few_beams_of()
/// \param missing memory for them, which is kept from query to query
std::vector<GroupsOfReading> groups_of(
    const std::vector<ReadingToSearch>& readings, const std::deque<std::vector<OverviewBeam>>& few, int truncation,
    std::vector<std::uint8_t>& missing)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	const auto whole_blocks = [](const ReadingToSearch& reading)
	{ return (reading.profiles.groups() + kBlock - 1) / kBlock * kBlock; };
	std::size_t size = 0;
	for (const ReadingToSearch& reading : readings) size += whole_blocks(reading);
	missing.resize(size);
	std::vector<GroupsOfReading> all;
	std::uint8_t* next = missing.data();
	std::size_t first = 0;
	auto beams = few.begin();
	for (const ReadingToSearch& reading : readings)
	{
		const auto& [profiles, scan, allowed] = reading;
		if (!all.empty() && &scan != &all.back().reading->scan) ++beams;
		const OverviewScan beams_here{
		    beams->data(), beams->size(), profiles.directions, static_cast<std::uint8_t>(truncation)};
		all.push_back({&reading, static_cast<std::int32_t>(first), next, beams_here, allowed.groups()});
		find_missing_beams(profiles, scan, next);
		next += whole_blocks(reading);
		first += profiles.groups();
	}
	return all;
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

void search_overviews(
    const std::vector<ReadingToSearch>& readings, const CoarseSearchParameters& parameters, std::vector<Pair>& pairs)
{
	thread_local std::vector<std::uint8_t> missing;  // kept for the next query
	const int truncation = parameters.truncation;
	const auto few = few_beams_of(readings, parameters);
	const std::vector<GroupsOfReading> all = groups_of(readings, few, truncation, missing);
	const std::uint32_t margin = overview_margin(readings.front().scan, parameters);
	CheapestPairs cheapest(margin, static_cast<std::size_t>(parameters.max_pairs), pairs);

	const int of_few = missing_at_few(all);
	for (const GroupsOfReading& of : all) look_where_missing(of, 0, of_few, cheapest);
	const auto least = static_cast<double>(cheapest.least());
	for (const GroupsOfReading& of : all)
		if (const int most = most_missing(of, least, parameters); most > of_few)
			look_where_missing(of, of_few + 1, most, cheapest);
	cheapest.drop_costly();
}
}  // namespace d2s1r
