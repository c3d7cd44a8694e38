// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "logs/log.h"
#include "ros/message_source.h"
#include "ros/ros_messages.h"

namespace d2s1r::logs
{
/// Opens a recording of ROS as a log: a laser is a topic of sensor_msgs/LaserScan, its pose on the robot comes from
/// tf_static and tf, the odometry from a topic of nav_msgs/Odometry or from tf. The recording is read once.
/// \param stop as open_log() has it
/// \throws LogError, Interrupted if `stop` said so
Log open_ros_log(
    const std::string& path, RosFormat format, const Stop& stop = [] { return false; });

/// Returns the angle [rad] of the middle of the beams, in the frame of the laser.
double middle_angle(const LaserScan& scan);

/// Returns the scan as MRPT has it, whose scans are symmetric to the x axis of the sensor.
/// \param laser its frame on the robot
mrpt::obs::CObservation2DRangeScan::Ptr to_observation(
    const LaserScan& scan, const mrpt::poses::CPose3D& laser, const std::string& label);
}  // namespace d2s1r::logs
