// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Observations typed in by hand.
#pragma once

#include <d2s1r/parameters.h>
#include <mrpt/obs/CObservation2DRangeScan.h>

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
inline mrpt::obs::CObservation2DRangeScan record(const std::vector<float>& ranges)
{
	mrpt::obs::CObservation2DRangeScan observation;
	observation.aperture = static_cast<float>(M_PI);
	observation.maxRange = 10;
	observation.resizeScan(ranges.size());
	for (std::size_t i = 0; i < ranges.size(); i++)
	{
		observation.setScanRange(i, ranges[i]);
		observation.setScanRangeValidity(i, true);
	}
	return observation;
}
}  // namespace d2s1r::test
