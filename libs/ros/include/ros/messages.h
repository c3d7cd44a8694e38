// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The fields of ROS messages that localization needs.
#pragma once

#include <mrpt/math/TPose2D.h>
#include <mrpt/math/TPose3D.h>
#include <mrpt/math/TTwist2D.h>
#include <mrpt/poses/CPose3D.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ros/bytes.h"

namespace d2s1r::ros
{
/// A time [ns] by the clock of the stamps of messages.
using Time = std::int64_t;
inline constexpr Time kSecond = 1'000'000'000;  //!< [ns]

/// Returns a time in seconds.
inline double seconds(Time time)
{
	return static_cast<double>(time) * 1e-9;
}

/// Says how the fields of a message follow each other.
enum class Encoding
{
	kRos1,  //!< little-endian, without gaps
	kCdr    //!< ROS 2: plain CDR (XCDR1 or XCDR2), aligned, after its encapsulation of 4 bytes
};

/// A message as it is stored or sent.
struct EncodedMessage
{
	Bytes data;
	Encoding encoding = Encoding::kCdr;
};

struct Header
{
	Time time = 0;      //!< since the epoch; 0: none, or before the epoch
	std::string frame;  //!< without the slash that ROS 1 may put in front
};

/// sensor_msgs/LaserScan, or the first echoes of a sensor_msgs/MultiEchoLaserScan, of which a beam without echo is NaN.
struct LaserScan
{
	Header header;          //!< frame: of the sensor; time: of the first beam
	float first_angle = 0;  //!< [rad] in the frame of the sensor
	float last_angle = 0;   //!< [rad] as the message has it, which may contradict angle_step and the number of beams
	float angle_step = 0;   //!< [rad] below zero: clockwise
	float time_step = 0;    //!< [s] from one beam to the next; 0: not told
	float scan_time = 0;    //!< [s] from one scan to the next; 0: not told
	float min_range = 0;    //!< [m] below that: no data
	float max_range = 0;    //!< [m] above that: no return
	std::vector<float> ranges;  //!< [m]
};

/// A point of a sensor_msgs/PointCloud2.
struct CloudPoint
{
	float x = 0, y = 0, z = 0;  //!< [m] in the frame of the sensor; NaN: no data
	float time = 0;             //!< [s] after the time of the message; 0 if no field tells it
};

/// sensor_msgs/PointCloud2, of which only positions and times are read.
struct PointCloud
{
	Header header;
	std::vector<CloudPoint> points;
};

/// A pose of one frame in another; no value if its rotation is none.
struct Transform
{
	Header header;                             //!< frame: the parent
	std::string child;                         //!< frame, without a slash in front
	std::optional<mrpt::poses::CPose3D> pose;  //!< child in parent
};

/// nav_msgs/OccupancyGrid
struct OccupancyGrid
{
	Header header;                     //!< frame: of the map
	double resolution = 0;             //!< [m] of a cell
	std::uint32_t width = 0;           //!< [cells]
	std::uint32_t height = 0;          //!< [cells]
	mrpt::math::TPose2D origin;        //!< lower left corner of cell (0, 0) in the frame of the map; NaN: not told
	std::vector<std::int8_t> percent;  //!< [%] probability that a cell is occupied, row by row; else unknown
};

/// geometry_msgs/PoseStamped or PoseWithCovarianceStamped, of which only the pose is read.
struct StampedPose
{
	Header header;                             //!< frame: that the pose is in
	std::optional<mrpt::poses::CPose3D> pose;  //!< no value if its rotation is none
};

/// nav_msgs/Odometry
struct Odometry
{
	Transform pose;                 //!< robot in the odometry's frame
	mrpt::math::TTwist2D velocity;  //!< [m/s, rad/s] robot frame
};

// \throws std::runtime_error if the message is too short for what it says; Unreadable if it is encoded in a way that is
// not known. Thread-safe.
Header decode_header(const EncodedMessage& message);  //!< of any message that begins with one
LaserScan decode_laser_scan(const EncodedMessage& message);
LaserScan decode_multi_echo_scan(const EncodedMessage& message);
PointCloud decode_point_cloud(const EncodedMessage& message);
StampedPose decode_stamped_pose(const EncodedMessage& message);
Odometry decode_odometry(const EncodedMessage& message);
std::vector<Transform> decode_transforms(const EncodedMessage& message);
OccupancyGrid decode_occupancy_grid(const EncodedMessage& message);
Time decode_clock(const EncodedMessage& message);  //!< rosgraph_msgs/Clock
}  // namespace d2s1r::ros
