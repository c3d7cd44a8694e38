// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "coarse/allowed_pairs.h"
#include "coarse/coarse_pairs.h"
#include "coarse/quantized_scan.h"
#include "coarse/range_profiles.h"

namespace d2s1r
{
/// A reading of a map that a scan is looked for in. It refers to its members.
struct ReadingToSearch
{
	const RangeProfiles& profiles;
	const QuantizedScan& scan;  //!< quantized as the profiles are
	const AllowedPairs& allowed;
};

/// Returns how many beams of a scan overviews are compared with: as many as have costs that a byte can sum up.
std::size_t count_overview_beams(const QuantizedScan& scan, int truncation);

/// Returns by how much [2 steps] these beams of a pair may cost more than those of the cheapest one.
std::uint32_t overview_margin(const QuantizedScan& scan, const CoarseSearchParameters& parameters);

/// Compares a few beams with the overviews of the groups, at the shifts that are allowed: first of the groups whose
/// range histograms are most like the scan's, then of all that may explain it as well as the best of those. Several
/// readings are searched as if they were one: what is found in one leaves out what is too costly in another.
/// \param readings one or more, with the same number of directions
/// \param pairs [2 steps] the cheapest pairs of group and shift, within the limits that coarse_search.h tells. The
///        groups of all readings are counted on, from one to the next.
void search_overviews(
    const std::vector<ReadingToSearch>& readings, const CoarseSearchParameters& parameters, std::vector<Pair>& pairs);
}  // namespace d2s1r
