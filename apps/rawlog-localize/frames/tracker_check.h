// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPose2D.h>
#include <ros/monitor.h>
#include <ros/robot_track.h>

#include <optional>
#include <utility>

namespace d2s1r::app
{
/// What a scan says about the tracker that was running when the log was recorded.
struct CheckedTracker
{
	WatchedScan scan;
	std::optional<mrpt::math::TPose2D> pose{};  //!< of the tracker, robot in map, m and rad, when the scan was taken
};

/// Gives each scan of a log the pose of the tracker at its time, and the verdict of the monitor.
class TrackerCheck
{
   public:
	/// \throws std::invalid_argument if a setting is out of range
	TrackerCheck(ros::TrackerTrack path, const WatchSettings& settings) : path_(std::move(path)), monitor_(settings) {}

	/// Returns the pose of the tracker at a time. \param robot its odometry
	std::optional<mrpt::poses::CPose2D> pose_at(ros::Time time, const ros::RobotTrack& robot) const
	{
		const auto told = path_.at(time, robot);
		return told ? std::optional(told->second) : std::nullopt;
	}

	/// Takes in the next scan; call it for every one that is localized.
	/// \param motion of the robot since the last call, in its frame then; no value: nobody measured it
	/// \param tracker its pose at the time of the scan; no value: not known
	CheckedTracker add(
	    const Localizer& localizer, const Scan& scan, const Localization& localization,
	    const std::optional<mrpt::poses::CPose2D>& motion, const std::optional<mrpt::poses::CPose2D>& tracker)
	{
		CheckedTracker checked{monitor_.add(localizer, scan, localization, motion, tracker)};
		if (tracker) checked.pose = tracker->asTPose();
		return checked;
	}

   private:
	ros::TrackerTrack path_;
	TrackerMonitor monitor_;
};
}  // namespace d2s1r::app
