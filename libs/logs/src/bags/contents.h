// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What the first reading of a recording of ROS finds.
#pragma once

#include <mrpt/poses/CPose3D.h>
#include <ros/messages.h>
#include <ros/sweep_guess.h>

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
/// What is wrong with a field in some messages.
struct CountedDoubt
{
	ScanDoubt first;           //!< what the first of them says
	std::size_t messages = 0;  //!< [-] that say the like
};

/// A topic of lasers.
struct LaserTopic
{
	std::string topic;
	MessageKind kind = MessageKind::kLaserScan;
	std::size_t messages = 0;
	std::map<std::string, std::size_t> frames{};  //!< [-] messages of each, those that came first if they are many
	std::vector<CountedDoubt> doubts{};           //!< what is wrong with the fields of its messages, each field once
	std::optional<OtherAngles> other_angles{};    //!< see Sensor
	ros::SweepGuess sweep_guess{};
};

/// A topic of odometry.
struct OdometryTopic
{
	std::string topic;
	std::size_t messages = 0;
	std::string child{};  //!< frame that it is about, by its first message
};

/// A transform from a frame to its parent, over the whole recording.
struct Link
{
	std::string parent;         //!< the last one
	mrpt::poses::CPose3D last;  //!< child in parent
	mrpt::poses::CPose3D first;
	bool moves = false;    //!< whether it is not the same all the time
	bool travels = false;  //!< whether it moves by more than a mount does
	/// The first one of a static topic that later tells another one; each counts from its message on.
	std::optional<ros::Transform> first_static = {};
};

/// Returns the last transform of a frame, without a time.
ros::Transform fixed_transform(const std::string& child, const Link& link);

/// Frames by their names, each with the transform to its parent.
using Links = std::map<std::string, Link>;

struct Contents
{
	std::vector<LaserTopic> lasers;           //!< in order of appearance, at most 250
	std::set<std::string> without_rotation;   //!< frames of transforms that have none and are left out
	std::vector<OdometryTopic> odometries;    //!< in order of appearance, at most 250
	std::map<std::string, Links> transforms;  //!< by the namespace of their topic, see namespace_of()
	bool is_complete = true;                  //!< whether all lasers and transforms are here
	std::string damage;
	std::string unread_scans;  //!< see MessageSource
};

/// Returns the namespace that a topic is in: "/robot1" of "/robot1/tf", and "" of "/tf".
std::string namespace_of(const std::string& topic);

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
