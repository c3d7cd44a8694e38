// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frame.h"

namespace d2s1r::app
{
double seconds(const mrpt::obs::CObservation& observation)
{
	return observation.timestamp == INVALID_TIMESTAMP ? 0.0 : mrpt::Clock::toDouble(observation.timestamp);
}
}  // namespace d2s1r::app
