// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "coarse/allowed_pairs.h"
#include "coarse/coarse_kernel.h"
#include "coarse/coarse_pairs.h"
#include "coarse/quantized_scan.h"
#include "coarse/searched_map.h"

namespace d2s1r
{
/// What the coarse search makes of a scan in one of the maps that are searched together.
struct ScanInMap
{
	const RangeProfiles& profiles;
	QuantizedScan scan;                                            //!< as the profiles are
	std::vector<OverviewBeam> overview_beams;                      //!< which overviews are compared with
	AllowedPairs allowed;                                          //!< by the prior of the map
	std::vector<std::uint64_t> allowed_groups = allowed.groups();  //!< by block
	std::int32_t first_group = 0, first_position = 0;  //!< numbers of the map's first ones among those of all maps
	std::size_t first_block = 0;                       //!< [-] the same of whole blocks of groups
	int most_missing = 0;  //!< [1 / kWhole] beams missing in the range histograms of the groups that were searched
};

/// Quantizes a scan for each map.
/// \param maps one or more, whose profiles have the same number of directions
std::vector<ScanInMap> scan_in_maps(
    const std::vector<SearchedMap>& maps, const Scan& scan, const CoarseSearchParameters& parameters);

/// Returns how many beams of a scan overviews are compared with: as many as have costs that a byte can sum up.
std::size_t count_overview_beams(const QuantizedScan& scan, int truncation);

/// Returns by how much [2 steps] these beams of a pair may cost more than those of the cheapest one.
std::uint32_t overview_margin(const QuantizedScan& scan, const CoarseSearchParameters& parameters);

inline constexpr std::uint32_t kAnyOverviewCost = 255;  //!< [2 steps] no pair of group and shift costs more

/// Compares a few beams with the overviews of the groups, at the shifts that are allowed: first of the groups whose
/// range histograms are most like the scan's, then of all that may explain it as well as the best of those. Several
/// maps are searched as if they were one: what is found in one leaves out what is too costly in another.
/// \param scans by map
/// \param most_cost [2 steps] what a pair may cost. With less than kAnyOverviewCost only the groups whose histograms are
///        most like the scan's are compared, which is much faster.
/// \param pairs [2 steps] the cheapest pairs of group and shift, within the limits that coarse_search.h tells. The
///        groups of all maps are counted on, from one to the next.
void search_overviews(
    std::vector<ScanInMap>& scans, const CoarseSearchParameters& parameters, std::uint32_t most_cost,
    std::vector<Pair>& pairs);

/// What a scan may cost, at most, at a place that equals its own.
struct CostOfEqual
{
	std::uint32_t overview = 0;  //!< [2 steps] of the beams that overviews are compared with
	std::uint32_t profile = 0;   //!< [step] of all beams
	int missing = 0;             //!< [1 / kWhole] beams missing in the range histogram of the group
};

/// Searches the groups that search_overviews() left out because too many beams are missing in their range histograms,
/// but not more than `most` has.
/// \param pairs those that cost at most what `most` says are appended, as many as search_overviews() may find
void search_groups_left_out(
    std::vector<ScanInMap>& scans, const CoarseSearchParameters& parameters, const CostOfEqual& most,
    std::vector<Pair>& pairs);

/// Returns the range histogram of a scan, as those of groups are.
std::array<std::uint8_t, RangeProfiles::kBins> histogram_of_scan(
    const RangeProfiles& profiles, const QuantizedScan& scan);
}  // namespace d2s1r
