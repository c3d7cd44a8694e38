// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Coordinate frames of a running robot, by time.
#pragma once

#include "live/live_localizer.h"

#include <mrpt/poses/CPose3D.h>

#include <deque>
#include <memory>
#include <optional>
#include <string>

namespace tf2
{
class BufferCore;
}

namespace d2s1r::live
{
/// Holds the transforms of the last ten seconds, as tf2 does.
class LiveFrames
{
   public:
	LiveFrames();
	~LiveFrames();

	/// Takes a transform, unless it is none that tf2 allows.
	void add(const ros::Transform& transform, bool is_static);

	/// Returns the pose of one frame in another at a time [ns]; 0: the newest. No value if they are not connected then.
	std::optional<mrpt::poses::CPose3D> pose_in(const std::string& frame, const std::string& other, Time time) const;

	/// Returns the newest time [ns] at which the pose of one frame in another is known; 0: at all times.
	std::optional<Time> newest(const std::string& frame, const std::string& other) const;

	/// Forgets all but static transforms.
	void clear();

   private:
	std::unique_ptr<tf2::BufferCore> buffer_;
	std::size_t frames_ = 0;  //!< [-] at most
};

/// Holds what messages of odometry said in the last ten seconds.
class OdometryTrack
{
   public:
	void add(Time time, const mrpt::poses::CPose2D& pose);

	/// Returns the pose in the frame of the odometry, between two messages; no value before the first and after the
	/// last one.
	std::optional<mrpt::poses::CPose2D> at(Time time) const;

	/// Returns the time [ns] of the newest message.
	std::optional<Time> newest() const;
	void clear() { poses_.clear(); }

   private:
	std::deque<std::pair<Time, mrpt::poses::CPose2D>> poses_;  //!< by increasing time
};
}  // namespace d2s1r::live
