// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPose2D.h>

#include <string>
#include <vector>

#include "frames/frame_store.h"

namespace d2s1r::app
{
/// Times that differ by less are the same.
inline constexpr double kSameTime = 1.0005e-3;  //!< [s] 1 ms and what six decimals round off

/// Holds a pose of the robot and its time.
struct TimedPose
{
	double timestamp = 0;      //!< [s] since the epoch
	mrpt::math::TPose2D pose;  //!< robot in the map frame, m and rad
};

/// Holds the poses, in the order of the file.
using GroundTruth = std::vector<TimedPose>;

/// Reads a file of poses (s, m, rad), the format of which shows in its first line:
/// - "time x y phi" or "time x y z yaw pitch roll", as MRPT has them,
/// - "time x y z qx qy qz qw", as TUM has them,
/// - names with commas, semicolons or tabs between them, in a comment also blanks, and below them numbers in the same
///   order: a time, x, y, and phi, yaw or theta or a quaternion; rows without a pose are passed over.
/// A time without a unit is in s, or in ms, us or ns if it is that large. Other lines that start with % or # are
/// comments. \throws UserError (kBadInput)
GroundTruth load_ground_truth(const std::string& file);

/// Holds poses, and the frame of the log that they are in.
struct PosesInFrame
{
	GroundTruth poses;
	std::string frame{};  //!< empty: not known, it is taken for that of the map
};

/// Reads what --ground-truth names: a file, as "topic:/odom" the poses of a topic of the log, or as "tf:map" those of
/// the robot in a frame of the log's transforms. \param label of the laser whose robot it is
/// \param damage of the log as far as it is known, see logs::read_poses_of_topic()
/// \throws UserError (kBadInput), logs::LogError
PosesInFrame read_ground_truth(
    const std::string& name, const std::string& log, const std::string& label, const std::string& damage);

/// Ground truth is interpolated between two lines that are at most so far apart [s].
inline constexpr double kGreatestGap = 0.5;

/// Ground truth by the clock of the log.
struct AlignedTruth
{
	GroundTruth lines;             //!< those of the file or, if some were interpolated, those that have a frame
	std::size_t interpolated = 0;  //!< [-] lines that were made between two of the file
	double offset = 0;             //!< [s] that the ground truth's clock is ahead of the log's; it has been taken off
};

/// Gives a pose of the ground truth to each frame that no line is within 1 ms of, but two lines at most kGreatestGap
/// apart are before and after. It looks first for the offset between the two clocks, of up to 5 s, at which the ground
/// truth fits to the poses of the localized frames; that counts only if the errors are less than half of those without.
AlignedTruth align_truth(const GroundTruth& truth, const std::vector<KeptFrame>& frames);

/// Returns whether headings that are taken for rad are degrees: some are beyond a turn, and the poses of the localized
/// frames agree with them only then.
bool are_headings_degrees(const GroundTruth& truth, const std::vector<KeptFrame>& frames);
}  // namespace d2s1r::app
