// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Where a running robot is by its odometry, which comes by tf or by messages of its own.
#pragma once

#include <ros/frames.h>
#include <ros/odometry_track.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "live/live_localizer.h"

namespace d2s1r::live
{
inline constexpr Time kStepBack = kSecond / 2;  //!< [ns] of a clock that ran back; less is that of messages

/// Returns a time in seconds.
inline double seconds(Time time)
{
	return static_cast<double>(time) * 1e-9;
}

/// Keeps the readings of a robot's odometry. Those of tf count if tf connects the robot with the frame of the odometry,
/// else those of the messages.
class LiveOdometry
{
   public:
	/// \param frame of the odometry; empty: that of the messages, else odom
	explicit LiveOdometry(std::string frame) : given_frame_(std::move(frame)) {}

	/// Takes a message.
	void add(const ros::Odometry& odometry);

	/// Takes the newest reading of tf. Call it whenever transforms have come.
	/// \param robot its frame
	void follow(const ros::Frames& frames, const std::string& robot);

	/// Returns the name of the frame of the odometry.
	std::string frame() const;

	/// Returns the frame that the messages are about; empty if none has come.
	const std::string& child() const { return child_; }

	/// Returns the pose in the frame of the odometry, between two readings; no value before the first and after the
	/// last one.
	std::optional<mrpt::poses::CPose2D> at(Time time) const;

	/// Returns the time of the last reading; no value if there is none.
	std::optional<Time> newest() const;

	/// Returns how the robot moved from one time to another, with the readings around these.
	/// \param zero the time that the poses count from
	std::vector<TimedPose> motion(Time zero, Time from, Time to) const;

	/// Forgets all readings.
	void clear();

   private:
	struct Track
	{
		void add(Time time, const mrpt::poses::CPose2D& pose);

		ros::OdometryTrack readings;
		Time newest = 0;  //!< 0: none
	};
	const Track& track() const { return by_tf_.newest > 0 ? by_tf_ : by_messages_; }
	std::string frame_in(const ros::Frames& frames, const std::string& robot) const;

	std::string given_frame_;
	std::string child_, frame_;                     //!< of the messages
	std::pair<std::string, std::string> followed_;  //!< robot and odometry in tf
	Track by_messages_, by_tf_;
};
}  // namespace d2s1r::live
