// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ros/messages.h"

#include <mrpt/poses/CPose3D.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace d2s1r::ros
{
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
	/// moving is forgotten. More than 200,000 moving transforms in the time of the history are left out.
	void add(const Transform& transform, bool is_static);

	/// Returns the pose of one frame in another; no value if they were not connected at that time, or if that is not
	/// known yet, or not any more.
	/// \param time [ns] since the epoch; 0: the latest at which it is known
	std::optional<mrpt::poses::CPose3D> pose_in(
	    const std::string& frame, const std::string& other, std::int64_t time) const;

	/// Returns where a frame was at one time, in itself at another; no value as pose_in() has it.
	/// \param fixed frame that does not move between the times, such as "odom"
	/// \param time, reference [ns] since the epoch
	std::optional<mrpt::poses::CPose3D> motion(
	    const std::string& frame, const std::string& fixed, std::int64_t time, std::int64_t reference) const;

   private:
	struct Buffer;
	std::unique_ptr<Buffer> buffer_;
};
}  // namespace d2s1r::ros
