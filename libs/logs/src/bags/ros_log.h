// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "bags/message_source.h"
#include "logs/log.h"

namespace d2s1r::logs
{
/// Opens a recording of ROS as a log: a laser is a topic of sensor_msgs/LaserScan (or PointCloud2), its pose on the
/// robot comes from tf_static and tf, the odometry from a topic of nav_msgs/Odometry or from tf. The recording is read
/// once. \param stop, cloud_height as open_log() has them \throws LogError, Interrupted if `stop` said so
Log open_ros_log(
    const std::string& path, RosFormat format, const Stop& stop = [] { return false; },
    const std::optional<ros::HeightBand>& cloud_height = {});
}  // namespace d2s1r::logs
