// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/tracker_check.h"

namespace d2s1r::app
{
std::optional<mrpt::poses::CPose2D> TrackerCheck::pose_at(ros::Time time, const ros::RobotTrack& robot) const
{
	const auto told = path_.at(time, robot);
	return told ? std::optional(told->second) : std::nullopt;
}

CheckedTracker TrackerCheck::add(
    const Localizer& localizer, const Scan& scan, const Localization& localization,
    const std::optional<mrpt::poses::CPose2D>& motion, const std::optional<mrpt::poses::CPose2D>& tracker)
{
	CheckedTracker checked{monitor_.add(localizer, scan, localization, motion, tracker)};
	if (tracker) checked.pose = tracker->asTPose();
	return checked;
}
}  // namespace d2s1r::app
