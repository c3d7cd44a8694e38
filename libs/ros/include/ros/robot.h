// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Which frame is the robot that carries a laser, and whose odometry is its own.
#pragma once

#include <mrpt/poses/CPose2D.h>
#include <mrpt/poses/CPose3D.h>

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "ros/messages.h"

namespace d2s1r::ros
{
/// A topic of lasers.
struct LaserTopic
{
	std::string topic;
	std::size_t messages = 0;
	std::map<std::string, std::size_t> frames{};  //!< [-] messages of each, those that came first if they are many
};

/// A topic of odometry.
struct OdometryTopic
{
	std::string topic;
	std::size_t messages = 0;
	std::string child{};  //!< frame that it is about, by its first message
	std::string frame{};  //!< that its poses are in, by the same message
};

/// A transform from a frame to its parent, over all that was heard.
struct Link
{
	std::string parent;         //!< the last one
	mrpt::poses::CPose3D last;  //!< child in parent
	mrpt::poses::CPose3D first;
	std::string other_parent = {};  //!< that it had before; empty: none
	bool moves = false;             //!< whether it is not the same all the time
	bool travels = false;           //!< whether it moves by more than a mount does
	/// The first one of a static topic that later tells another one; each counts from its message on.
	std::optional<Transform> first_static = {};
};

/// Returns the last transform of a frame, without a time.
Transform fixed_transform(const std::string& child, const Link& link);

/// Frames by their names, each with the transform to its parent.
using Links = std::map<std::string, Link>;

/// Returns the namespace that a topic is in: "/robot1" of "/robot1/tf", and "" of "/tf".
std::string namespace_of(const std::string& topic);

/// Holds what the messages of one or more robots tell of their lasers, their odometry and their frames.
struct RobotTopics
{
	/// Returns the laser of a topic, or the odometry, a new one if it is not known; null if there are too many.
	LaserTopic* laser(const std::string& topic);
	OdometryTopic* odometry(const std::string& topic);

	/// Counts a message of a laser, which is in a frame.
	void count(LaserTopic& laser, const std::string& frame);

	/// Takes the transforms of a message. \param topic whose namespace they are in
	void add_transforms(const std::string& topic, const std::vector<Transform>& all, bool are_static);

	/// Returns whether there is room for another frame.
	bool has_room() const;

	/// Forgets all other frames than these.
	void keep_only(const std::set<std::string>& frames);

	std::vector<LaserTopic> lasers;           //!< in order of appearance, at most 250
	std::vector<OdometryTopic> odometries;    //!< in order of appearance, at most 250
	std::map<std::string, Links> transforms;  //!< by the namespace of their topic, see namespace_of()
	bool is_complete = true;                  //!< whether all lasers and transforms are here
	std::size_t changes = 0;                  //!< [-] after which another robot may be found

   private:
	void add(const Transform& transform, bool is_static, Links& links);

	std::map<std::string, std::size_t> laser_places_, odometry_places_;  //!< by topic
	std::size_t links_ = 0, frames_ = 0;
};

/// The robot that carries a laser, among the frames and the topics of all.
struct Robot
{
	std::string laser_frame;     //!< that most of the laser's scans have, of those that are in tf
	std::string name_space;      //!< of its topics of transforms
	std::string frame;           //!< empty: not known, poses are those of the laser
	std::string odometry_topic;  //!< empty: none
	std::string odometry_child;  //!< frame that the topic is about, if it is not the robot's; else empty
	std::string odometry_frame;  //!< ancestor of the robot in tf, whose odometry it is; empty: none
};

/// The way from one frame to another.
struct Path
{
	mrpt::poses::CPose3D pose;  //!< of the first frame in the other one, by the last transforms
	bool moves = false;         //!< whether it is not the same all the time
};

/// The links of a namespace with those of the root, which all robots share. It refers to the topics.
class LinksOfRobot
{
   public:
	LinksOfRobot(const RobotTopics& topics, const std::string& name_space);

	/// Returns the transform of a frame to its parent; null if there is none.
	const Link* find(const std::string& frame) const;

	/// Returns whether tf knows a frame, as a child or as a parent.
	bool knows(const std::string& frame) const { return parts_.count(frame) > 0; }

	/// Returns a frame that tf knows and that one it does not know may stand for: a part of its name, as simulators
	/// name "robot/laser_link/laser"; empty if there is none.
	std::string meant_by(const std::string& frame) const;

	/// Returns whether two frames are on the same robot: transforms connect them that do not go through the world, such
	/// as map or odom, nor along a link that travels.
	bool are_on_one_robot(const std::string& a, const std::string& b) const;

	/// Returns the frames above `frame` on its robot, its parent first, at most 1,000.
	std::vector<std::string> carriers(const std::string& frame) const;

	/// Returns the frames above `frame`, its parent first, the world's included, at most 1,000.
	std::vector<std::string> ancestors(const std::string& frame) const;

	/// Returns the frames that move `frame` in one above it, each with its parent; none if it is not above it.
	std::set<std::string> links_up(const std::string& frame, const std::string& ancestor) const;

	/// Returns how a laser's frame stands on a robot; no value if that is not known.
	std::optional<Path> placement(const std::string& laser, const Robot& robot) const;

	/// Returns the way from a frame to another one; no value if they are not connected.
	std::optional<Path> path(const std::string& frame, const std::string& other) const;

	/// Returns the frames on the robot of `frame` that have this name, base_link or base_footprint, after their last
	/// slash.
	std::vector<std::string> named(const std::string& name, const std::string& frame) const;

   private:
	void connect(const Links& links);
	Path climb(const std::string& frame, const std::string& ancestor) const;
	std::string_view root(std::string_view frame) const;

	const Links* own_;
	const Links* shared_;
	mutable std::map<std::string_view, std::string_view> parts_;  //!< frames of the same robot lead to the same frame
	std::vector<std::string_view> bases_;                         //!< frames that are named like a robot's
};

/// Keeps LinksOfRobot by namespace.
class AllLinks
{
   public:
	explicit AllLinks(const RobotTopics& topics) : topics_(topics) {}
	const LinksOfRobot& of(const std::string& name_space);

   private:
	const RobotTopics& topics_;
	std::map<std::string, std::unique_ptr<LinksOfRobot>> links_;
};

/// Carries poses of the robot, in the frame of an odometry that is about another frame of it, over to the robot.
class CarriedOdometry
{
   public:
	/// Returns the pose in a frame that is level where the robot was first.
	mrpt::poses::CPose2D operator()(const mrpt::poses::CPose3D& robot)
	{
		if (!first_) first_ = robot;
		return mrpt::poses::CPose2D(robot - *first_);
	}

   private:
	std::optional<mrpt::poses::CPose3D> first_;
};

/// Finds the robot of a laser. Its frame is the one that its odometry is about, if that is named base_link or
/// base_footprint; else base_link, else base_footprint, if it carries the laser; else the one that its odometry is
/// about, if that carries the laser; else base_link, else base_footprint, else the topmost frame that carries the
/// laser.
/// \param known its frame, if that is known; else empty
Robot find_robot(const LaserTopic& laser, const RobotTopics& topics, AllLinks& links, const std::string& known = "");
}  // namespace d2s1r::ros
