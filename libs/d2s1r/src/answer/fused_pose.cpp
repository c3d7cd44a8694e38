// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/fused_pose.h>

namespace d2s1r
{
const char* to_string(FusionStatus status)
{
	switch (status)
	{
		case FusionStatus::kTracking:
			return "tracking";
		case FusionStatus::kAmbiguous:
			break;
	}
	return "ambiguous";
}

const char* to_string(FusionEvent event)
{
	switch (event)
	{
		case FusionEvent::kSeeded:
			return "seeded";
		case FusionEvent::kReseeded:
			return "reseeded";
		case FusionEvent::kNone:
			break;
	}
	return "-";
}
}  // namespace d2s1r
