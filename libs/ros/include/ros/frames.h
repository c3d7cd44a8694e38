// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/poses/CPose3D.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "ros/messages.h"

namespace d2s1r::ros
{
/// Says how long what is known at the time of a transform waits for it, by the clock of the robot or of the recording.
inline constexpr Time kLongestWaitForTransforms = kSecond;  //!< [ns]

/// Coordinate frames over time, as tf and tf_static connect them. This is tf2's buffer: a frame has one parent at a
/// time, poses are interpolated between two transforms and never extrapolated, static transforms hold at all times.
/// Beyond that it bounds its memory, and prints nothing. A frame that is more than 1,000 transforms away is not found.
/// Not thread-safe.
class Frames
{
   public:
	/// \param history [s] of the moving transforms that are kept
	explicit Frames(double history = 10);
	~Frames();
	Frames(Frames&&) noexcept;
	Frames& operator=(Frames&&) noexcept;

	/// Takes a transform, unless it has no pose, connects a frame with itself, or a moving one has no time. If the time
	/// of a moving transform is before all that is kept, the clock was set back (a log that is played again): what was
	/// moving is forgotten. More than 200,000 moving transforms in the time of the history are left out, and more than
	/// 10,000 frames.
	void add(const Transform& transform, bool is_static);

	/// Returns the pose of one frame in another; no value if they were not connected at that time, or if that is not
	/// known yet, or not any more.
	/// \param time 0: the latest at which it is known
	std::optional<mrpt::poses::CPose3D> pose_in(const std::string& frame, const std::string& other, Time time) const;

	/// Returns the newest time at which the pose of one frame in another is known; no value if they are not
	/// connected, or if no moving transform is between them.
	std::optional<Time> newest(const std::string& frame, const std::string& other) const;

	/// Forgets all but static transforms.
	void forget_moving();

	/// Returns whether there is room for another transform.
	bool has_room() const;

	/// Forgets all but the static transforms of these frames.
	void keep_only(const std::set<std::string>& frames);

   private:
	struct Buffer;
	std::unique_ptr<Buffer> buffer_;
};
}  // namespace d2s1r::ros
