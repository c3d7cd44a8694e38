// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Observations typed in by hand.
#pragma once

#include <d2s1r/parameters.h>
#include <d2s1r/range_scan.h>

#include <cmath>
#include <vector>

namespace d2s1r::test
{
inline ScanParameters few_beams()
{
	ScanParameters parameters;
	parameters.min_beams = 1;
	return parameters;
}

/// Beams over half a turn, maximum range 10 m, first beam on the right.
inline RangeScan record(const std::vector<float>& ranges)
{
	RangeScan observation;
	observation.ranges = ranges;
	observation.valid.assign(ranges.size(), 1);
	observation.aperture = static_cast<float>(M_PI);
	observation.max_range = 10;
	return observation;
}
}  // namespace d2s1r::test
