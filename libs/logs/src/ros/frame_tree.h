// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ros/ros_messages.h"

#include <map>
#include <optional>
#include <string>
#include <utility>

namespace d2s1r::logs
{
/// Coordinate frames as tf and tf_static connect them, with the latest transform between any two.
class FrameTree
{
   public:
	/// Takes a transform, unless it has no pose.
	void add(const Transform& transform);

	/// Returns the pose of one frame in another, by the fewest transforms; no value if they are not connected.
	std::optional<mrpt::poses::CPose3D> pose_in(const std::string& frame, const std::string& other) const;

	/// Returns the frames above `frame`, its parent first.
	std::vector<std::string> ancestors(const std::string& frame) const;

   private:
	/// Poses of children in their parents, by the names of parent and child.
	std::map<std::pair<std::string, std::string>, mrpt::poses::CPose3D> poses_;
	std::map<std::string, std::vector<std::string>> neighbours_;
	std::map<std::string, std::string> parents_;  //!< the first one of each frame
};
}  // namespace d2s1r::logs
