// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/observation.h>

#include <functional>
#include <memory>
#include <set>
#include <string>

#include "bags/contents.h"
#include "logs/log.h"

namespace d2s1r::logs
{
/// What the first reading of a recording found about the robot of the laser that is used.
struct RobotOfLog
{
	RobotOfLog(
	    std::shared_ptr<const Contents> the_contents, std::shared_ptr<ros::AllLinks> links_of_all,
	    const ros::LaserTopic& laser);

	/// Returns how a laser's frame stands on the robot; no value if that is not known.
	std::optional<ros::Path> placement(const std::string& frame) const { return links->placement(frame, robot); }

	std::shared_ptr<const Contents> contents;
	std::shared_ptr<ros::AllLinks> all_links;  //!< that refer to the contents
	const ros::LinksOfRobot* links = nullptr;  //!< of these
	ros::Robot robot;
	std::set<std::string> odometry_links;  //!< frames whose transforms tell of the odometry
};

/// Reads a recording a second time: its messages become observations of one robot. A laser whose pose moves is read at
/// the time of its scan, for which the reader waits for transforms that were recorded up to a second later.
/// \param open opens the recording
/// \param cloud_height the points of clouds that make scans
std::unique_ptr<LogReader> read_robot(
    std::function<std::unique_ptr<MessageSource>()> open, const RobotOfLog& robot, const ros::HeightBand& cloud_height);
}  // namespace d2s1r::logs
