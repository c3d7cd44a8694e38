// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "bags/contents.h"

#include <algorithm>
#include <cmath>

#include "logs/errors.h"

namespace d2s1r::logs
{
namespace
{
constexpr std::size_t kMostLinks = 10'000;   // [-] robots have less than a hundred; bounds memory and time
constexpr std::size_t kMostNamespaces = 30;  // [-] of topics of transforms
constexpr std::size_t kMostTopics = 250;     // [-] of lasers, and of odometry
constexpr std::size_t kMostFrames = 10'000;  // [-] of all lasers
constexpr double kMountTravels = 1;          // [m] farther than a laser's mount moves on a robot

/// Returns what `decode` makes of the message.
template <typename Decode>
auto decoded(const Message& message, const Decode& decode)
{
	return decode(ros::EncodedMessage{message.data, message.topic->encoding});
}

void set_time_if_none(ros::Header& header, const Message& message)
{
	if (header.time == 0) header.time = message.time;
}

bool are_the_same(const mrpt::poses::CPose3D& a, const mrpt::poses::CPose3D& b)
{
	constexpr double kLeastDistance = 1e-3, kLeastAngle = 1e-3;  // [m], [rad] far below what a scan shows
	if (a == b) return true;
	const auto difference = b - a;
	const double turned = std::acos(std::clamp((difference.getRotationMatrix().trace() - 1) / 2, -1.0, 1.0));
	return difference.norm() < kLeastDistance && turned < kLeastAngle;
}

/// Collects what the messages tell, one after the other.
class ContentsReader
{
   public:
	void add_scan(const Message& message)
	{
		LaserTopic* const found = find(message, contents.lasers, lasers_);
		if (!found) contents.is_complete = false;
		if (!found) return;
		LaserTopic& laser = *found;
		laser.kind = message.topic->kind;
		look_at(message, laser);
		laser.messages++;
		const std::string frame = header_of(message).frame;
		const auto known = laser.frames.find(frame);
		if (known != laser.frames.end())
			known->second++;
		else if (frames_++ < kMostFrames)
			laser.frames.emplace(frame, 1);
	}

	void add_odometry(const Message& message)
	{
		OdometryTopic* const odometry = find(message, contents.odometries, odometries_);
		if (odometry && odometry->messages++ == 0) odometry->child = odometry_of(message).pose.child;
	}

	void add_transforms(const Message& message)
	{
		const std::string name = namespace_of(message.topic->name);
		auto& all = contents.transforms;
		if (all.size() >= kMostNamespaces && all.count(name) == 0)
		{
			contents.is_complete = false;
			return;
		}
		Links& links = all[name];
		for (const ros::Transform& transform : transforms_of(message)) add(transform, is_static(message), links);
	}

	Contents contents;

   private:
	/// Looks at the fields of a laser's message. \throws Unreadable if its first one is a cloud of a kind that is not
	/// read
	static void look_at(const Message& message, LaserTopic& laser)
	{
		if (message.topic->kind == MessageKind::kPointCloud)
		{
			if (laser.messages == 0) point_cloud_of(message);
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
		laser.sweep_guess.add(scan);
	}

	void add(const ros::Transform& transform, bool is_static, Links& links)
	{
		constexpr std::size_t kMostWithoutRotation = 10;  // [-] that are told
		const std::string& parent = transform.header.frame;
		if (!transform.pose && contents.without_rotation.size() < kMostWithoutRotation)
			contents.without_rotation.insert(transform.child);
		if (!transform.pose || parent.empty() || transform.child.empty() || parent == transform.child) return;
		auto known = links.find(transform.child);
		if (known == links.end())
		{
			contents.is_complete = contents.is_complete && links_ < kMostLinks;
			if (links_++ < kMostLinks) links.emplace(transform.child, Link{parent, *transform.pose, *transform.pose});
			return;
		}
		Link& link = known->second;
		const bool is_other = link.parent != parent;
		if (is_static && !link.first_static && (is_other || !are_the_same(link.last, *transform.pose)))
			link.first_static = fixed_transform(known->first, link);
		link.last = *transform.pose;
		if (is_other || is_static) link.parent = parent, link.first = link.last;
		link.moves =
		    link.moves || link.first_static || (is_other && !is_static) || !are_the_same(link.first, link.last);
		const double traveled = (link.last.m_coords - link.first.m_coords).norm();
		link.travels = link.travels || traveled > kMountTravels;
	}

	/// The topic of a message among others; null if there are too many.
	template <typename Topic>
	static Topic* find(const Message& message, std::vector<Topic>& topics, std::map<std::string, std::size_t>& places)
	{
		const auto known = places.find(message.topic->name);
		if (known != places.end()) return &topics[known->second];
		if (topics.size() >= kMostTopics) return nullptr;
		places.emplace(message.topic->name, topics.size());
		topics.emplace_back().topic = message.topic->name;
		return &topics.back();
	}

	std::map<std::string, std::size_t> lasers_, odometries_;  //!< their places, by topic
	std::size_t links_ = 0, frames_ = 0;
};
}  // namespace

ros::Transform fixed_transform(const std::string& child, const Link& link)
{
	ros::Transform transform;
	transform.header.frame = link.parent;
	transform.child = child;
	transform.pose = link.last;
	return transform;
}

std::string namespace_of(const std::string& topic)
{
	const auto slash = topic.find_last_of('/');
	return slash == std::string::npos ? "" : topic.substr(0, slash);
}

bool is_static(const Message& message)
{
	return message.topic->name.find("static", namespace_of(message.topic->name).size()) != std::string::npos;
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
