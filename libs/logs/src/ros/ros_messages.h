// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The fields of ROS messages that localization needs.
#pragma once

#include "ros/message_source.h"

#include <mrpt/math/TPose3D.h>
#include <mrpt/math/TTwist2D.h>
#include <mrpt/poses/CPose3D.h>

#include <optional>
#include <string>
#include <vector>

namespace d2s1r::logs
{
struct Header
{
	std::int64_t time = 0;  //!< [ns] since the epoch; 0: none
	std::string frame;      //!< without the slash that ROS 1 may put in front
};

/// sensor_msgs/LaserScan
struct LaserScan
{
	Header header;              //!< frame: of the sensor
	float first_angle = 0;      //!< [rad] in the frame of the sensor
	float angle_step = 0;       //!< [rad] below zero: clockwise
	float scan_time = 0;        //!< [s]
	float min_range = 0;        //!< [m] below that: no data
	float max_range = 0;        //!< [m] above that: no return
	std::vector<float> ranges;  //!< [m]
};

/// A pose of one frame in another; no value if its rotation is none.
struct Transform
{
	Header header;                             //!< frame: the parent
	std::string child;                         //!< frame, without a slash in front
	std::optional<mrpt::poses::CPose3D> pose;  //!< child in parent
};

/// nav_msgs/Odometry
struct OdometryMessage
{
	Transform pose;                 //!< robot in the odometry's frame
	mrpt::math::TTwist2D velocity;  //!< [m/s, rad/s] robot frame
};

// \throws std::runtime_error if the message is too short for what it says, or this program cannot decode its encoding
LaserScan decode_laser_scan(const Message& message);
OdometryMessage decode_odometry(const Message& message);
std::vector<Transform> decode_transforms(const Message& message);
}  // namespace d2s1r::logs
