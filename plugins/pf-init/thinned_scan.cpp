// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "thinned_scan.h"

namespace d2s1r::pf
{
mrpt::obs::CObservation2DRangeScan thinned(const mrpt::obs::CObservation2DRangeScan& scan, std::size_t beams)
{
	if (scan.getScanSize() <= beams) return scan;
	const std::size_t gaps = scan.getScanSize() - 1, stride = gaps / beams + 1, kept = gaps / stride + 1;
	mrpt::obs::CObservation2DRangeScan few = scan;
	few.resizeScan(kept);
	for (std::size_t i = 0; i < kept; i++)
	{
		few.setScanRange(i, scan.getScanRange(i * stride));
		few.setScanRangeValidity(i, scan.getScanRangeValidity(i * stride));
	}
	few.aperture = scan.aperture * static_cast<float>(stride * (kept - 1)) / static_cast<float>(gaps);
	const double cut = 0.5 * static_cast<double>(scan.aperture - few.aperture);  // at the end of the scan only
	few.sensorPose = scan.sensorPose + mrpt::poses::CPose3D(0, 0, 0, scan.rightToLeft ? -cut : cut, 0, 0);
	return few;
}
}  // namespace d2s1r::pf
