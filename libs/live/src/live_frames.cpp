// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "live_frames.h"

#include <console_bridge/console.h>
#include <geometry_msgs/TransformStamped.h>
#include <mrpt/math/CQuaternion.h>
#include <mrpt/math/wrap2pi.h>
#include <tf2/buffer_core.h>
#include <tf2/exceptions.h>

#include <algorithm>

namespace d2s1r::live
{
namespace
{
constexpr Time kHistory = 10'000'000'000;  // [ns]
constexpr std::size_t kMostFrames = 2000;  // [-] of a robot; a sender of nonsense may name any number

/// Returns no value if tf2 cannot hold the time.
std::optional<::ros::Time> to_ros(Time time)
{
	constexpr Time kSecond = 1'000'000'000;
	if (time < 0 || time / kSecond > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
	return ::ros::Time(static_cast<std::uint32_t>(time / kSecond), static_cast<std::uint32_t>(time % kSecond));
}

geometry_msgs::TransformStamped to_message(const ros::Transform& transform, const ::ros::Time& time)
{
	geometry_msgs::TransformStamped message;
	message.header.stamp = time;
	message.header.frame_id = transform.header.frame;
	message.child_frame_id = transform.child;
	message.transform.translation.x = transform.pose->x();
	message.transform.translation.y = transform.pose->y();
	message.transform.translation.z = transform.pose->z();
	mrpt::math::CQuaternionDouble turn;
	transform.pose->getAsQuaternion(turn);
	message.transform.rotation.w = turn.r();
	message.transform.rotation.x = turn.x();
	message.transform.rotation.y = turn.y();
	message.transform.rotation.z = turn.z();
	return message;
}
}  // namespace

LiveFrames::LiveFrames() : buffer_(std::make_unique<tf2::BufferCore>(::ros::Duration(10.0)))
{
	console_bridge::noOutputHandler();  // a library does not print
}

LiveFrames::~LiveFrames() = default;

void LiveFrames::add(const ros::Transform& transform, bool is_static)
{
	const std::string &parent = transform.header.frame, &child = transform.child;
	const auto time = to_ros(transform.header.time);
	if (!transform.pose || parent == child || parent.empty() || child.empty() || !time) return;
	for (const std::string* frame : {&parent, &child})
		if (!buffer_->_frameExists(*frame) && ++frames_ > kMostFrames) return;
	buffer_->setTransform(to_message(transform, *time), "d2s1r", is_static);
}

std::optional<mrpt::poses::CPose3D> LiveFrames::pose_in(
    const std::string& frame, const std::string& other, Time time) const
{
	const auto at = to_ros(time);
	if (!at || frame.empty() || other.empty()) return std::nullopt;
	if (frame == other) return mrpt::poses::CPose3D();
	if (!buffer_->canTransform(other, frame, *at)) return std::nullopt;
	const auto found = buffer_->lookupTransform(other, frame, *at).transform;
	const mrpt::math::CQuaternionDouble turn(found.rotation.w, found.rotation.x, found.rotation.y, found.rotation.z);
	return mrpt::poses::CPose3D(turn, found.translation.x, found.translation.y, found.translation.z);
}

std::optional<Time> LiveFrames::newest(const std::string& frame, const std::string& other) const
{
	if (frame.empty() || other.empty() || !buffer_->canTransform(other, frame, ::ros::Time(0))) return std::nullopt;
	const ::ros::Time found = buffer_->lookupTransform(other, frame, ::ros::Time(0)).header.stamp;
	return static_cast<Time>(found.toNSec());
}

void LiveFrames::clear()
{
	buffer_->clear();  // which keeps static transforms
}

void OdometryTrack::add(Time time, const mrpt::poses::CPose2D& pose)
{
	if (!poses_.empty() && time <= poses_.back().first) return;
	poses_.emplace_back(time, pose);
	while (poses_.front().first < time - kHistory) poses_.pop_front();
}

std::optional<mrpt::poses::CPose2D> OdometryTrack::at(Time time) const
{
	const auto is_before = [](const auto& pose, Time t) { return pose.first < t; };
	const auto after = std::lower_bound(poses_.begin(), poses_.end(), time, is_before);
	if (after == poses_.end()) return std::nullopt;
	if (after->first == time) return after->second;
	if (after == poses_.begin()) return std::nullopt;
	const auto& [t0, a] = *std::prev(after);
	const double share = static_cast<double>(time - t0) / static_cast<double>(after->first - t0);
	const auto& b = after->second;
	return mrpt::poses::CPose2D(
	    a.x() + share * (b.x() - a.x()), a.y() + share * (b.y() - a.y()),
	    a.phi() + share * mrpt::math::wrapToPi(b.phi() - a.phi()));
}

std::optional<Time> OdometryTrack::newest() const
{
	return poses_.empty() ? std::nullopt : std::optional(poses_.back().first);
}
}  // namespace d2s1r::live
