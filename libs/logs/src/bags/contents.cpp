// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "bags/contents.h"

#include <algorithm>

#include "logs/errors.h"

namespace d2s1r::logs
{
namespace
{
template <typename Decode>
auto decoded(const Message& message, const Decode& decode)
{
	return decode(ros::EncodedMessage{message.data, message.topic->encoding});
}

void set_time_if_none(ros::Header& header, const Message& message)
{
	if (header.time == 0) header.time = message.time;
}

class ContentsReader
{
   public:
	void add_scan(const Message& message)
	{
		ros::LaserTopic* const laser = contents.topics.laser(message.topic->name);
		if (!laser) return;
		look_at(message, *laser, contents.lasers[laser->topic]);
		contents.topics.count(*laser, header_of(message).frame);
	}

	void add_odometry(const Message& message)
	{
		ros::OdometryTopic* const odometry = contents.topics.odometry(message.topic->name);
		if (!odometry || odometry->messages++ > 0) return;
		const ros::Transform pose = odometry_of(message).pose;
		odometry->child = pose.child;
		odometry->frame = pose.header.frame;
	}

	void add_transforms(const Message& message)
	{
		constexpr std::size_t kMostWithoutRotation = 10;  // [-] that are told
		const std::vector<ros::Transform> transforms = transforms_of(message);
		for (const ros::Transform& transform : transforms)
			if (!transform.pose && contents.without_rotation.size() < kMostWithoutRotation)
				contents.without_rotation.insert(transform.child);
		contents.topics.add_transforms(message.topic->name, transforms, is_static(message));
	}

	Contents contents;

   private:
	/// Looks at the fields of a laser's message. \throws Unreadable if its first one is a cloud of a kind that is not
	/// read
	static void look_at(const Message& message, ros::LaserTopic& topic, LaserOfLog& laser)
	{
		laser.kind = message.topic->kind;
		if (message.topic->kind == MessageKind::kPointCloud)
		{
			if (topic.messages == 0) point_cloud_of(message);
			return;
		}
		const ros::LaserScan scan = laser_scan_of(message);
		for (const ScanDoubt& doubt : doubts_about_fields(scan))
		{
			const auto known = std::find_if(
			    laser.doubts.begin(), laser.doubts.end(),
			    [&](const CountedDoubt& other) { return other.first.field == doubt.field; });
			if (known == laser.doubts.end())
				laser.doubts.push_back({doubt, 1});
			else
				known->messages++;
		}
		if (!laser.other_angles) laser.other_angles = other_angles_of(scan);
	}
};
}  // namespace

bool is_static(const Message& message)
{
	return message.topic->name.find("static", ros::namespace_of(message.topic->name).size()) != std::string::npos;
}

Contents read_contents(MessageSource& source)
{
	ContentsReader reader;
	try
	{
		while (const auto message = source.next()) hand_to(reader, *message);
		reader.contents.damage = source.damage();
	}
	catch (const LogError&)
	{
		throw;
	}
	catch (const std::exception& e)
	{
		reader.contents.damage = describe_damage(e);
	}
	reader.contents.unread_scans = source.unread_scans();
	return std::move(reader.contents);
}

ros::Header header_of(const Message& message)
{
	ros::Header header = decoded(message, ros::decode_header);
	set_time_if_none(header, message);
	return header;
}

ros::LaserScan laser_scan_of(const Message& message)
{
	const bool has_echoes = message.topic->kind == MessageKind::kMultiEchoLaserScan;
	ros::LaserScan scan = decoded(message, has_echoes ? ros::decode_multi_echo_scan : ros::decode_laser_scan);
	set_time_if_none(scan.header, message);
	return scan;
}

ros::PointCloud point_cloud_of(const Message& message)
{
	ros::PointCloud cloud = decoded(message, ros::decode_point_cloud);
	set_time_if_none(cloud.header, message);
	return cloud;
}

ros::Odometry odometry_of(const Message& message)
{
	ros::Odometry odometry = decoded(message, ros::decode_odometry);
	set_time_if_none(odometry.pose.header, message);
	return odometry;
}

ros::StampedPose stamped_pose_of(const Message& message)
{
	ros::StampedPose pose = decoded(message, ros::decode_stamped_pose);
	set_time_if_none(pose.header, message);
	return pose;
}

std::vector<ros::Transform> transforms_of(const Message& message)
{
	std::vector<ros::Transform> transforms = decoded(message, ros::decode_transforms);
	for (ros::Transform& transform : transforms) set_time_if_none(transform.header, message);
	return transforms;
}
}  // namespace d2s1r::logs
