// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "coarse/coarse_kernel.h"
#include "coarse/coarse_pairs.h"
#include "coarse/scan_in_map.h"

namespace d2s1r
{
/// Returns by how much [2 steps] the beams that overviews are compared with may cost more at a pair than at the
/// cheapest one.
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
    const std::vector<ScanInMap>& scans, const CoarseSearchParameters& parameters, std::uint32_t most_cost,
    std::vector<Pair>& pairs);

/// What overviews show beside places that equal, cell for cell, the one where the sensor is. The middles of groups
/// stand elsewhere beside such a place than they do here, by up to half of what lies between them.
struct EqualOverview
{
	std::vector<OverviewBeam> beams;  //!< between which ranges they are there, where the scan's beams end on walls
	int most_missing = 0;             //!< [1 / kWhole] beams missing in the range histogram of the group, at most
};

/// Searches all groups whose overviews show about what they do at places that equal another, whatever the scan costs
/// there: the ranges may be apart by a little more in all. A depth edge may be seen from here and not from there, so
/// that no beam counts for much.
/// \param pairs [2 steps] pairs of group and shift, with what the ranges are apart; if there are more than
///        search_overviews() may find, the most equal ones
void search_equal_groups(
    const std::vector<ScanInMap>& scans, const CoarseSearchParameters& parameters, const EqualOverview& equal,
    std::vector<Pair>& pairs);

/// Returns the range histogram of a scan, as those of groups are.
std::array<std::uint8_t, RangeProfiles::kBins> histogram_of_scan(
    const RangeProfiles& profiles, const QuantizedScan& scan);
}  // namespace d2s1r
