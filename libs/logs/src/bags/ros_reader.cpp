// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "bags/ros_reader.h"

#include <ros/frames.h>
#include <ros/observation.h>

#include <algorithm>
#include <deque>
#include <map>
#include <set>
#include <utility>

#include "bags/scan_doubts.h"
#include "logs/errors.h"

namespace d2s1r::logs
{
namespace
{
using Pose = mrpt::poses::CPose3D;

constexpr std::size_t kMostPaths = 10'000;  // [-] whose poses are kept

class MovingFrames
{
   public:
	MovingFrames(const ros::RobotTopics& topics, const std::string& name_space, const ros::LinksOfRobot& links)
	    : name_space_(name_space), links_(links)
	{
		for (const std::string& name : {std::string(), name_space})
		{
			const auto found = topics.transforms.find(name);
			if (found == topics.transforms.end()) continue;
			for (const auto& [child, link] : found->second)
			{
				if (links.find(child) != &link) continue;
				if (!link.moves) frames_.add(ros::fixed_transform(child, link), true);
				if (link.first_static) frames_.add(*link.first_static, true);
			}
		}
	}

	void add(const Message& message, const std::vector<ros::Transform>& transforms)
	{
		const std::string name = ros::namespace_of(message.topic->name);
		if (!name.empty() && name != name_space_) return;
		const bool is_fixed = is_static(message);
		for (const ros::Transform& transform : transforms)
			if (const ros::Link* const link = links_.find(transform.child);
			    link && (is_fixed ? link->first_static.has_value() : link->moves))
				frames_.add(transform, is_fixed);
	}

	std::optional<Pose> pose_in(const std::string& frame, const std::string& other, std::int64_t time) const
	{
		return frames_.pose_in(frame, other, time);
	}

   private:
	ros::Frames frames_;
	std::string name_space_;
	const ros::LinksOfRobot& links_;
};

/// A message that may wait for the pose of a frame at its time.
struct Pending
{
	Message message;
	std::string frame, other;  //!< the pose of the first one in the other one is needed
	std::int64_t time = 0;     //!< [ns]
	bool waits = false;        //!< whether it must be looked up at the time
};

class RosReader : public LogReader
{
   public:
	RosReader(
	    std::function<std::unique_ptr<MessageSource>()> open, const RobotOfLog& robot,
	    const ros::HeightBand& cloud_height)
	    : open_(std::move(open)),
	      cloud_height_(cloud_height),
	      robot_(robot),
	      frames_(robot_.contents->topics, robot_.robot.name_space, *robot_.links)
	{
	}

	/// Ends without damage when the caller asks to stop.
	std::optional<RawlogObject> next() override
	{
		for (;;)
		{
			if (auto object = take_pending()) return object;
			if (is_at_end_)
			{
				damage_ = damage_at_end_;
				return std::nullopt;
			}
			read_message();
		}
	}

	void add_scan(const Message& message)
	{
		const ros::Header header = header_of(message);
		const auto& lasers = robot_.contents->topics.lasers;
		const bool is_known = std::any_of(
		    lasers.begin(), lasers.end(),
		    [&](const ros::LaserTopic& laser) { return laser.topic == message.topic->name; });
		if (is_known) hold({message, header.frame, robot_.robot.frame, header.time});
	}

	void add_odometry(const Message& message)
	{
		const ros::Robot& robot = robot_.robot;
		if (message.topic->name != robot.odometry_topic) return;
		const ros::Transform pose = odometry_of(message).pose;
		if (robot.odometry_child.empty())
			hold({message, "", "", pose.header.time});
		else if (pose.child == robot.odometry_child)
			hold({message, robot.frame, robot.odometry_child, pose.header.time});
	}

	/// The message is odometry, too, if that comes from tf and the message moves the robot.
	void add_transforms(const Message& message)
	{
		const std::vector<ros::Transform> transforms = transforms_of(message);
		frames_.add(message, transforms);
		std::int64_t time = 0;
		if (is_static(message)) return;
		for (const ros::Transform& transform : transforms)
			if (robot_.odometry_links.count(transform.child) > 0) time = std::max(time, transform.header.time);
		if (time != 0) hold({message, robot_.robot.frame, robot_.robot.odometry_frame, time});
	}

   private:
	void read_message()
	try
	{
		if (!source_) source_ = open_();
		const auto message = source_->next();
		if (message)
		{
			newest_ = std::max(newest_, message->time);
			return hand_to(*this, *message);
		}
		is_at_end_ = true;
		damage_at_end_ = source_->damage();
	}
	catch (const LogError&)
	{
		throw;
	}
	catch (const Interrupted&)
	{
		is_at_end_ = true;
		pending_.clear();
	}
	catch (const std::exception& e)
	{
		is_at_end_ = true;
		damage_at_end_ = describe_damage(e);
	}

	void hold(Pending pending)
	{
		const bool needs_pose = !pending.frame.empty() && !pending.other.empty();
		if (needs_pose)
		{
			const auto& path = path_between(pending.frame, pending.other);
			pending.waits = path && path->moves;
		}
		pending_bytes_ += pending.message.data.size;
		pending_.push_back(std::move(pending));
	}

	/// Returns the next object whose pose is known, or will not be known.
	std::optional<RawlogObject> take_pending()
	try
	{
		while (!pending_.empty())
		{
			const Pending& first = pending_.front();
			std::optional<Pose> pose;
			if (first.waits) pose = frames_.pose_in(first.frame, first.other, first.time);
			const bool is_late = is_at_end_ || newest_ - first.message.time > ros::kLongestWaitForTransforms ||
			                     pending_bytes_ > ros::kMostBytesWaiting;
			if (first.waits && !pose && !is_late) return std::nullopt;
			const Pending taken = std::move(pending_.front());
			pending_.pop_front();
			pending_bytes_ -= taken.message.data.size;
			if (auto object = convert(taken, pose)) return object;
		}
		return std::nullopt;
	}
	catch (const std::exception& e)
	{
		is_at_end_ = true;
		pending_.clear();
		damage_at_end_ = describe_damage(e);
		return std::nullopt;
	}

	/// Returns no value if the message is none that localization needs.
	/// \param pose of the frame that it waited for; no value if it is not known
	std::optional<RawlogObject> convert(const Pending& taken, const std::optional<Pose>& pose)
	{
		if (taken.message.topic->kind == MessageKind::kOdometry) return convert_odometry(taken, pose);
		if (taken.message.topic->kind == MessageKind::kTransforms) return convert_transforms(taken, pose);
		return convert_scan(taken, pose);
	}

	RawlogObject convert_scan(const Pending& taken, std::optional<Pose> pose)
	{
		ScanDetails details;
		details.time = taken.time;
		if (!taken.waits) pose = fixed_pose(taken.frame, taken.other);
		const std::string& topic = taken.message.topic->name;
		RawlogObject object;
		if (taken.message.topic->kind == MessageKind::kPointCloud)
		{
			const ros::PointCloud cloud = point_cloud_of(taken.message);
			const auto scan = ros::to_scan(cloud, pose.value_or(Pose()), cloud_height_);
			details.sweep = scan.sweep;
			object = object_of({scan.scan, topic, ros::to_time(cloud.header.time)});
		}
		else
		{
			const ros::LaserScan scan = laser_scan_of(taken.message);
			details.sweep = ros::sweep_time_of(scan);
			if (const auto other = other_angles_of(scan); other && !other->is_possible)
				details.unusable = {other->because, ScanDoubt::Field::kAngles};
			const RangeScan read = ros::to_scan(scan, pose.value_or(Pose()));
			object = object_of({read, topic, ros::to_time(scan.header.time), {}, ros::middle_angle(scan)});
		}
		if (!pose) details.unusable = {unknown_pose(taken), ScanDoubt::Field::kLaserPose};
		object.details = {details};
		return object;
	}

	static std::string unknown_pose(const Pending& taken)
	{
		const std::string frame = "its frame '" + taken.frame + "'";
		return taken.waits ? "tf does not tell where " + frame + " was at its time"
		                   : "tf has no transform from " + frame + " to the robot";
	}

	/// The way from a frame to another one, as RobotOfLog::placement() has it if that is the robot's.
	const std::optional<ros::Path>& path_between(const std::string& frame, const std::string& other)
	{
		if (paths_.size() > kMostPaths) paths_.clear();
		const auto [found, is_new] = paths_.try_emplace({frame, other});
		if (is_new)
			found->second = other == robot_.robot.frame ? robot_.placement(frame) : robot_.links->path(frame, other);
		return found->second;
	}

	/// The last pose of a frame in another one, which is the same all the time.
	std::optional<Pose> fixed_pose(const std::string& frame, const std::string& other)
	{
		const auto& path = path_between(frame, other);
		return path ? std::optional<Pose>(path->pose) : std::nullopt;
	}

	/// Odometry without a pose is none.
	std::optional<RawlogObject> convert_odometry(const Pending& taken, std::optional<Pose> robot_in_child)
	{
		const ros::Odometry odometry = odometry_of(taken.message);
		const ros::Transform& told = odometry.pose;
		if (!told.pose) return std::nullopt;
		OdometryReading reading = {
		    taken.message.topic->name, ros::to_time(told.header.time), mrpt::poses::CPose2D(*told.pose),
		    odometry.velocity};
		if (!robot_.robot.odometry_child.empty())
		{
			if (!taken.waits) robot_in_child = fixed_pose(taken.frame, taken.other);
			if (!robot_in_child) return std::nullopt;
			reading.pose = carried_(*told.pose + *robot_in_child);
			reading.velocity.reset();  // it is that of the other frame
		}
		RawlogObject object = object_of(std::move(reading));
		object.odometry_time = taken.time;
		return object;
	}

	std::optional<RawlogObject> convert_transforms(const Pending& taken, std::optional<Pose> pose)
	{
		if (!taken.waits) pose = fixed_pose(taken.frame, taken.other);
		if (!pose) return std::nullopt;
		RawlogObject object =
		    object_of({taken.message.topic->name, ros::to_time(taken.time), mrpt::poses::CPose2D(*pose)});
		object.odometry_time = taken.time;
		object.odometry_source = ros::OdometrySource::kTransforms;
		if (!robot_.robot.odometry_topic.empty()) object.reading.reset();  // beside messages, it is none of the log
		return object;
	}

	std::function<std::unique_ptr<MessageSource>()> open_;
	ros::HeightBand cloud_height_;
	RobotOfLog robot_;
	MovingFrames frames_;
	std::map<std::pair<std::string, std::string>, std::optional<ros::Path>> paths_;
	std::unique_ptr<MessageSource> source_;
	std::deque<Pending> pending_;
	std::size_t pending_bytes_ = 0;
	std::int64_t newest_ = 0;  //!< [ns] time of recording of what was read
	bool is_at_end_ = false;
	std::string damage_at_end_;
	ros::CarriedOdometry carried_;  //!< odometry that is about another frame
};
}  // namespace

RobotOfLog::RobotOfLog(
    std::shared_ptr<const Contents> the_contents, std::shared_ptr<ros::AllLinks> links_of_all,
    const ros::LaserTopic& laser)
    : contents(std::move(the_contents)), all_links(std::move(links_of_all))
{
	robot = ros::find_robot(laser, contents->topics, *all_links);
	links = &all_links->of(robot.name_space);
	if (!robot.odometry_frame.empty()) odometry_links = links->links_up(robot.frame, robot.odometry_frame);
}

std::unique_ptr<LogReader> read_robot(
    std::function<std::unique_ptr<MessageSource>()> open, const RobotOfLog& robot, const ros::HeightBand& cloud_height)
{
	return std::make_unique<RosReader>(std::move(open), robot, cloud_height);
}
}  // namespace d2s1r::logs
