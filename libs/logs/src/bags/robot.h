// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Which frame is the robot that carries a laser, and whose odometry is its own.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bags/contents.h"

namespace d2s1r::logs
{
/// The robot that carries a laser, among the frames and the topics of a recording.
struct Robot
{
	std::string laser_frame;     //!< that most of the laser's scans have, of those that are in tf
	std::string name_space;      //!< of its topics of transforms
	std::string frame;           //!< empty: not known, poses are those of the laser
	std::string odometry_topic;  //!< empty: none, or from tf
	std::string odometry_child;  //!< frame that the topic is about, if it is not the robot's; else empty
	std::string odometry_frame;  //!< ancestor of the robot in tf, whose odometry it is; empty: not used
};

/// The way from one frame to another.
struct Path
{
	mrpt::poses::CPose3D pose;  //!< of the first frame in the other one, by the last transforms
	bool moves = false;         //!< whether it is not the same all the time
};

/// The links of a namespace with those of the recording's root, which all robots share. It refers to the contents.
class LinksOfRobot
{
   public:
	LinksOfRobot(const Contents& contents, const std::string& name_space);

	/// Returns the transform of a frame to its parent; null if there is none.
	const Link* find(const std::string& frame) const;

	/// Returns whether tf knows a frame, as a child or as a parent.
	bool knows(const std::string& frame) const { return parts_.count(frame) > 0; }

	/// Returns whether two frames are on the same robot: transforms connect them that do not go through the world, such
	/// as map or odom, nor along a link that travels.
	bool are_on_one_robot(const std::string& a, const std::string& b) const;

	/// Returns the frames above `frame` on its robot, its parent first, at most 1,000.
	std::vector<std::string> carriers(const std::string& frame) const;

	/// Returns the frames above `frame`, its parent first, the world's included, at most 1,000.
	std::vector<std::string> ancestors(const std::string& frame) const;

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
	explicit AllLinks(const Contents& contents) : contents_(contents) {}
	const LinksOfRobot& of(const std::string& name_space);

   private:
	const Contents& contents_;
	std::map<std::string, std::unique_ptr<LinksOfRobot>> links_;
};

/// Finds the robot of a laser. Its frame is the one that its odometry is about, if that is named base_link or
/// base_footprint; else base_link, else base_footprint, if it carries the laser; else the one that its odometry is
/// about, if that carries the laser; else base_link, else base_footprint, else the topmost frame that carries the
/// laser.
Robot find_robot(const LaserTopic& laser, const Contents& contents, AllLinks& links);
}  // namespace d2s1r::logs
