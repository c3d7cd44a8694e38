// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The poses of a robot in a frame of its recording, such as map.
#include <ros/frames.h>

#include <algorithm>
#include <deque>
#include <set>

#include "bags/ros_log.h"
#include "bags/ros_reader.h"
#include "logs/errors.h"

namespace d2s1r::logs
{
namespace
{
constexpr std::int64_t kLongestWait = 2'000'000'000;  // [ns] for the other transforms between the frames

/// Reads where a robot was in a frame whenever one of the transforms between them is told.
class FramePoses
{
   public:
	FramePoses(const RobotOfLog& robot, const std::string& frame)
	    : robot_(robot), frame_(frame), children_(robot.links->links_up(robot.robot.frame, frame))
	{
		for (const auto& [name, links] : robot.contents->topics.transforms)
			for (const auto& [child, link] : links)
			{
				if (!is_of_robot(name) || robot.links->find(child) != &link) continue;
				if (!link.moves) frames_.add(ros::fixed_transform(child, link), true);
				if (link.first_static) frames_.add(*link.first_static, true);
			}
	}

	/// Returns whether the robot is below the frame.
	bool is_connected() const { return !children_.empty(); }

	void add(const Message& message)
	{
		if (message.topic->kind != MessageKind::kTransforms) return;
		if (!is_of_robot(ros::namespace_of(message.topic->name))) return;
		for (const ros::Transform& transform : transforms_of(message))
		{
			const ros::Link* const link = robot_.links->find(transform.child);
			if (link && is_static(message) && link->first_static) frames_.add(transform, true);
			if (!link || is_static(message) || !link->moves) continue;
			frames_.add(transform, false);
			if (children_.count(transform.child) > 0) times_.insert(transform.header.time);
		}
		take_known();
	}

	std::vector<StampedPose> poses;

   private:
	bool is_of_robot(const std::string& name_space) const
	{
		return name_space.empty() || name_space == robot_.robot.name_space;
	}

	void take_known()
	{
		while (!times_.empty())
		{
			const std::int64_t time = *times_.begin();
			const auto pose = frames_.pose_in(robot_.robot.frame, frame_, time);
			if (!pose && *times_.rbegin() - time < kLongestWait) return;
			if (pose) poses.emplace_back(static_cast<double>(time) * 1e-9, mrpt::poses::CPose2D(*pose).asTPose());
			times_.erase(times_.begin());
		}
	}

	const RobotOfLog& robot_;
	std::string frame_;
	std::set<std::string> children_;  //!< frames whose transforms connect the robot with the frame
	ros::Frames frames_;
	std::set<std::int64_t> times_;  //!< [ns] of which the poses are not known yet
};
}  // namespace

std::vector<StampedPose> read_poses_of_frame(
    const std::string& path, const std::string& frame, const std::string& label, const std::string& known_damage)
{
	const auto format = recognize_ros(path);
	if (!format) throw LogError(path, "is no recording of ROS, so that it has no frame '" + frame + "'; name a file");
	const auto contents = std::make_shared<const Contents>(read_contents(*open_messages(path, *format)));
	const auto& lasers = contents->topics.lasers;
	const auto laser =
	    std::find_if(lasers.begin(), lasers.end(), [&](const ros::LaserTopic& known) { return known.topic == label; });
	const RobotOfLog robot(
	    contents, std::make_shared<ros::AllLinks>(contents->topics),
	    laser == lasers.end() ? ros::LaserTopic() : *laser);
	FramePoses poses(robot, frame);
	if (!poses.is_connected())
		throw LogError(
		    path, "has no transforms from the robot's frame '" + robot.robot.frame + "' up to the frame '" + frame +
		              "'; name another frame");
	const auto source = open_messages(path, *format);
	std::string damage;
	try
	{
		while (const auto message = source->next()) poses.add(*message);
		damage = source->damage();
	}
	catch (const LogError&)
	{
		throw;
	}
	catch (const std::exception& e)
	{
		damage = describe_damage(e);
	}
	if (!damage.empty() && (known_damage.empty() || poses.poses.empty())) throw LogError(path, damage);
	if (poses.poses.empty())
		throw LogError(
		    path, "never tells at one time all transforms from '" + robot.robot.frame + "' to '" + frame +
		              "'; name another frame");
	return poses.poses;
}
}  // namespace d2s1r::logs
