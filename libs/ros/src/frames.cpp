// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/frames.h"

#include <console_bridge/console.h>
#include <tf2/buffer_core.h>
#include <tf2/exceptions.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

namespace d2s1r::ros
{
namespace
{
constexpr std::size_t kMostInHistory = 200'000;  // [-] moving transforms, of 150 bytes
constexpr std::size_t kMostLate = 1000;          // [-] of these that come after later ones: they are searched
constexpr std::size_t kMostFrames = 10'000;      // [-] robots have less than a hundred
constexpr Time kLastSecond = std::numeric_limits<std::uint32_t>::max();

/// Says whether tf2 can hold a time [ns] of a moving transform; it takes 0 for the latest time.
bool is_time(Time time)
{
	return time > 0 && time / kSecond < kLastSecond;
}

::ros::Time to_ros(Time time)
{
	return {static_cast<std::uint32_t>(time / kSecond), static_cast<std::uint32_t>(time % kSecond)};
}

geometry_msgs::TransformStamped to_ros(const Transform& transform, Time time)
{
	geometry_msgs::TransformStamped message;
	message.header.frame_id = transform.header.frame;
	message.header.stamp = to_ros(time);
	message.child_frame_id = transform.child;
	mrpt::math::CQuaternionDouble rotation;
	transform.pose->getAsQuaternion(rotation);
	message.transform.translation.x = transform.pose->x();
	message.transform.translation.y = transform.pose->y();
	message.transform.translation.z = transform.pose->z();
	message.transform.rotation.w = rotation.r();
	message.transform.rotation.x = rotation.x();
	message.transform.rotation.y = rotation.y();
	message.transform.rotation.z = rotation.z();
	return message;
}

mrpt::poses::CPose3D to_mrpt(const geometry_msgs::Transform& transform)
{
	const auto& [x, y, z, w] =
	    std::tie(transform.rotation.x, transform.rotation.y, transform.rotation.z, transform.rotation.w);
	mrpt::math::CQuaternionDouble rotation(w, x, y, z);
	rotation.normalize();
	return {rotation, transform.translation.x, transform.translation.y, transform.translation.z};
}

/// tf2 tells through this what it does not take.
void silence_tf2()
{
	static const bool is_silent = (console_bridge::noOutputHandler(), true);
	(void)is_silent;
}
}  // namespace

struct Frames::Buffer
{
	explicit Buffer(double seconds)
	    : history(static_cast<Time>(seconds * static_cast<double>(kSecond))), core(::ros::Duration(seconds))
	{
	}

	/// Returns whether there is room for the frames of a transform.
	bool takes(const Transform& transform)
	{
		for (const std::string* frame : {&transform.header.frame, &transform.child})
			if (!core._frameExists(*frame) && ++frames > kMostFrames) return false;
		return true;
	}

	void add_static(const Transform& transform)
	{
		if (!takes(transform)) return;
		core.setTransform(to_ros(transform, kSecond), "", true);
		statics[transform.child] = transform;
	}

	void add_moving(const Transform& transform)
	{
		const Time time = transform.header.time;
		if (!is_time(time)) return;
		if (time < newest - history) forget_moving();
		if (time > counted_from + history) counted_from = time, in_history = 0, late = 0;
		if (++in_history > kMostInHistory || (time < newest && ++late > kMostLate) || !takes(transform)) return;
		core.setTransform(to_ros(transform, time), "", false);
		newest = std::max(newest, time);
	}

	void forget_moving()
	{
		core.clear();
		for (const auto& [child, transform] : statics) core.setTransform(to_ros(transform, kSecond), "", true);
		newest = counted_from = 0;
	}

	Time history;
	tf2::BufferCore core;
	std::map<std::string, Transform> statics;  //!< by their children
	std::size_t frames = 0;                    //!< [-] at most
	Time newest = 0;                           //!< of the moving transforms
	Time counted_from = 0;                     //!< time since which these are counted:
	std::size_t in_history = 0;                //!< [-] moving transforms
	std::size_t late = 0;                      //!< [-] of these that came after later ones
};

Frames::Frames(double history)
{
	silence_tf2();
	buffer_ = std::make_unique<Buffer>(history);
}

Frames::~Frames() = default;
Frames::Frames(Frames&&) noexcept = default;
Frames& Frames::operator=(Frames&&) noexcept = default;

void Frames::add(const Transform& transform, bool is_static)
{
	if (!transform.pose || transform.child.empty() || transform.header.frame.empty()) return;
	if (transform.child == transform.header.frame) return;
	if (is_static)
		buffer_->add_static(transform);
	else
		buffer_->add_moving(transform);
}

std::optional<mrpt::poses::CPose3D> Frames::pose_in(const std::string& frame, const std::string& other, Time time) const
try
{
	if (frame == other) return mrpt::poses::CPose3D();
	if (time != 0 && !is_time(time)) return std::nullopt;
	return to_mrpt(buffer_->core.lookupTransform(other, frame, to_ros(time)).transform);
}
catch (const tf2::TransformException&)
{
	return std::nullopt;
}

std::optional<Time> Frames::newest(const std::string& frame, const std::string& other) const
try
{
	if (frame.empty() || other.empty()) return std::nullopt;
	const ::ros::Time found = buffer_->core.lookupTransform(other, frame, ::ros::Time(0)).header.stamp;
	return found.isZero() ? std::nullopt : std::optional(static_cast<Time>(found.toNSec()));
}
catch (const tf2::TransformException&)
{
	return std::nullopt;
}

void Frames::forget_moving()
{
	buffer_->forget_moving();
}

bool Frames::has_room() const
{
	return buffer_->frames + 2 <= kMostFrames;
}

void Frames::keep_only(const std::set<std::string>& frames)
{
	auto& statics = buffer_->statics;
	for (auto at = statics.begin(); at != statics.end();)
		at = frames.count(at->first) > 0 ? std::next(at) : statics.erase(at);
	buffer_->forget_moving();
	buffer_->frames = 2 * statics.size();
}
}  // namespace d2s1r::ros
