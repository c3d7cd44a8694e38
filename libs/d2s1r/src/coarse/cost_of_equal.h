// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPose2D.h>

#include <cstdint>

#include "coarse/overview_search.h"

namespace d2s1r
{
/// Returns what a scan may cost at places that equal, cell for cell, the place where its sensor is. Samples and the
/// middles of groups stand elsewhere beside such a place than they do here, by up to half of what lies between them.
/// The ranges are cast from the corners of these squares around the sensor, and the greatest costs count. Thread-safe.
/// \param in the scan, as the profiles of `map` are
/// \param sensor in map, m and rad
CostOfEqual cost_of_equal(
    const ScanInMap& in, const SearchedMap& map, const mrpt::math::TPose2D& sensor,
    const CoarseSearchParameters& parameters);
}  // namespace d2s1r
