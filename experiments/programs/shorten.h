// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation2DRangeScan.h>

namespace d2s1r::experiments
{
/// Changes a scan into what a laser would say that sees nothing from `reach` [m] on.
inline void shorten(mrpt::obs::CObservation2DRangeScan& scan, float reach)
{
	if (reach >= scan.maxRange) return;
	for (std::size_t beam = 0; beam < scan.getScanSize(); beam++)
	{
		const float range = scan.getScanRange(beam);
		const bool is_data = scan.getScanRangeValidity(beam) || range >= scan.maxRange;
		if (!is_data || range < reach) continue;
		scan.setScanRange(beam, reach);
		scan.setScanRangeValidity(beam, false);
	}
	scan.maxRange = reach;
}
}  // namespace d2s1r::experiments
