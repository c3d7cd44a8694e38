// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "coarse/allowed_pairs.h"
#include "coarse/coarse_pairs.h"
#include "coarse/quantized_scan.h"
#include "coarse/range_profiles.h"

namespace d2s1r
{
/// Compares a few beams with the overviews of the groups, at the shifts that are allowed: first of the groups whose
/// range histograms are most like the scan's, then of all that may explain it as well as the best of those.
/// \param pairs [2 steps] the cheapest pairs of group and shift, within the limits that coarse_search.h tells
void search_overviews(
    const RangeProfiles& profiles, const QuantizedScan& scan, const CoarseSearchParameters& parameters,
    const AllowedPairs& allowed, std::vector<Pair>& pairs);
}  // namespace d2s1r
