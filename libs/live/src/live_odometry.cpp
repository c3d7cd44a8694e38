// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "live_odometry.h"

#include <algorithm>

namespace d2s1r::live
{
void LiveOdometry::Track::add(Time time, const mrpt::poses::CPose2D& pose)
{
	if (time < newest - kStepBack) *this = {};
	if (time <= newest) return;
	readings.add({seconds(time), pose.asTPose()});
	newest = time;
}

void LiveOdometry::add(const ros::Odometry& odometry)
{
	const ros::Transform& pose = odometry.pose;
	if (!pose.pose || pose.header.time <= 0) return;
	child_ = pose.child;
	frame_ = pose.header.frame;
	by_messages_.add(pose.header.time, mrpt::poses::CPose2D(*pose.pose));
}

/// Returns the frame of the odometry if moving transforms connect the robot with it; else an empty text.
std::string LiveOdometry::frame_in(const ros::Frames& frames, const std::string& robot) const
{
	for (const std::string& frame :
	     given_frame_.empty() ? std::vector<std::string>{frame_, "odom"} : std::vector{given_frame_})
		if (frame != robot && frames.newest(robot, frame)) return frame;
	return "";
}

void LiveOdometry::follow(const ros::Frames& frames, const std::string& robot)
{
	const std::string frame = frame_in(frames, robot);
	if (followed_ != std::pair(robot, frame)) by_tf_ = {};
	followed_ = {robot, frame};
	const auto newest = frame.empty() ? std::nullopt : frames.newest(robot, frame);
	const auto pose = newest ? frames.pose_in(robot, frame, *newest) : std::nullopt;
	if (pose) by_tf_.add(*newest, mrpt::poses::CPose2D(*pose));
}

std::string LiveOdometry::frame() const
{
	if (by_tf_.newest > 0) return followed_.second;
	if (!given_frame_.empty()) return given_frame_;
	return frame_.empty() ? "odom" : frame_;
}

std::optional<mrpt::poses::CPose2D> LiveOdometry::at(Time time) const
{
	const auto pose = track().readings.at(seconds(time));
	return pose ? std::optional(mrpt::poses::CPose2D(*pose)) : std::nullopt;
}

std::optional<Time> LiveOdometry::newest() const
{
	return track().newest > 0 ? std::optional(track().newest) : std::nullopt;
}

std::vector<TimedPose> LiveOdometry::motion(Time zero, Time from, Time to) const
{
	std::vector<TimedPose> poses;
	for (const auto& [time, pose] : track().readings.over(seconds(from), seconds(to)))
		poses.push_back({time - seconds(zero), pose});
	return poses;
}

void LiveOdometry::clear()
{
	by_messages_ = by_tf_ = {};
}
}  // namespace d2s1r::live
