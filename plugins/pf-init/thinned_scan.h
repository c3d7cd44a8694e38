// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation2DRangeScan.h>

namespace d2s1r::pf
{
/// Every n-th beam of `scan`, at most `beams` of them and the first one: MRPT's filter has the map look at the whole
/// scan for every particle.
mrpt::obs::CObservation2DRangeScan thinned(const mrpt::obs::CObservation2DRangeScan& scan, std::size_t beams);
}  // namespace d2s1r::pf
