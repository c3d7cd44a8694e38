// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
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
/// \param stop null, or asked now and then: if it returns true, the search ends with what it has found so far
/// \param pairs [2 steps] the cheapest pairs of group and shift, within the limits that coarse_search.h tells. The
///        groups of all maps are counted on, from one to the next.
void search_overviews(
    const std::vector<ScanInMap>& scans, const CoarseSearchParameters& parameters, std::uint32_t most_cost,
    const std::function<bool()>& stop, std::vector<Pair>& pairs);
}  // namespace d2s1r
