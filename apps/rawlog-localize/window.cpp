// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "window.h"

namespace d2s1r::app
{
Localization Window::judge(const mrpt::obs::CObservation2DRangeScan& scan, const Localization& one_shot)
{
	return window_.add(make_scan(scan, localizer_.parameters().scan), one_shot, odometry_.take());
}
}  // namespace d2s1r::app
