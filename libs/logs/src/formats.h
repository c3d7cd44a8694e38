// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Opens the logs of each format; open_log() finds out which it is. Each log is read once.
// \param stop, left_out, cloud_height as open_log() has them \throws LogError, Interrupted if `stop` said so
#pragma once

#include "bags/message_source.h"
#include "logs/log.h"

namespace d2s1r::logs
{
/// Returns whether a text looks like the start of a CARMEN log.
bool is_carmen_text(const std::string& start);

/// Opens a CARMEN log, plain or packed: lasers FLASER, RLASER and ROBOTLASER1, odometry from their lines and from ODOM.
Log open_carmen_log(
    const std::string& path, const Stop& stop = [] { return false; });

/// Whether this build reads rawlogs.
extern const bool kReadsRawlogs;

/// Reads a rawlog to its end, or to where it is damaged, in a process of its own. Later only what has been read there
/// without harm is read again. \throws std::bad_alloc if there is too little memory
Log open_rawlog(const std::string& file, const Stop& stop, const Labels& left_out = {});

/// Opens a recording of ROS as a log: a laser is a topic of sensor_msgs/LaserScan (or PointCloud2), its pose on the
/// robot comes from tf_static and tf, the odometry from a topic of nav_msgs/Odometry or from tf.
Log open_ros_log(
    const std::string& path, RosFormat format, const Stop& stop = [] { return false; },
    const std::optional<ros::HeightBand>& cloud_height = {});
}  // namespace d2s1r::logs
