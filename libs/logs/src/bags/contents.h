// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What the first reading of a recording of ROS finds.
#pragma once

#include <ros/messages.h>
#include <ros/robot.h>

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bags/message_source.h"
#include "bags/scan_doubts.h"
#include "logs/log.h"

namespace d2s1r::logs
{
struct CountedDoubt
{
	ScanDoubt first;           //!< what the first of them says
	std::size_t messages = 0;  //!< [-] that say the like
};

struct LaserOfLog
{
	MessageKind kind = MessageKind::kLaserScan;
	std::vector<CountedDoubt> doubts{};         //!< what is wrong with the fields of its messages, each field once
	std::optional<OtherAngles> other_angles{};  //!< see Sensor
};

struct Contents
{
	ros::RobotTopics topics;
	std::map<std::string, LaserOfLog> lasers;  //!< by topic, those of `topics`
	std::set<std::string> without_rotation;    //!< frames of transforms that have none and are left out
	std::string damage;
	std::string unread_scans;  //!< see MessageSource
};

/// Returns whether the transforms of a message hold at all times, by the name of its topic.
bool is_static(const Message& message);

/// Reads a recording to its end. \throws LogError, Interrupted
Contents read_contents(MessageSource& source);

/// Hands a message of a laser, of odometry or of transforms to the `reader`, and no other.
template <typename Reader>
void hand_to(Reader& reader, const Message& message)
{
	switch (message.topic->kind)
	{
		case MessageKind::kLaserScan:
		case MessageKind::kMultiEchoLaserScan:
		case MessageKind::kPointCloud:
			return reader.add_scan(message);
		case MessageKind::kOdometry:
			return reader.add_odometry(message);
		case MessageKind::kTransforms:
			return reader.add_transforms(message);
		case MessageKind::kStampedPose:
		case MessageKind::kOther:
			return;
	}
}

// The messages of a recording, of their own time or, if they have none, that of their recording.
// \throws as ros::decode_laser_scan()
ros::Header header_of(const Message& message);
ros::LaserScan laser_scan_of(const Message& message);
ros::PointCloud point_cloud_of(const Message& message);
ros::Odometry odometry_of(const Message& message);
ros::StampedPose stamped_pose_of(const Message& message);
std::vector<ros::Transform> transforms_of(const Message& message);
}  // namespace d2s1r::logs
