// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>
#include <logs/log.h>

#include <string>
#include <vector>

#include "frames/frame_store.h"

namespace d2s1r::app
{
/// Times that differ by less are the same.
inline constexpr double kSameTime = 1.0005e-3;  //!< [s] 1 ms and what six decimals round off

/// Ground truth is interpolated between two lines that are at most so far apart [s].
inline constexpr double kGreatestGap = 0.5;

/// Holds true poses in the map frame, with times [s] since the epoch, in the order of the file.
using GroundTruth = std::vector<TimedPose>;

/// Reads a file of poses (s, m, rad): "time x y phi" or "time x y z yaw pitch roll", as MRPT has them, "time x y z qx
/// qy qz qw", as TUM has them, or columns with names in the first line: a time, x, y, and phi, yaw or theta or a
/// quaternion; rows without a pose are passed over. A time is in s, or in ms, us or ns if it is that large. Other lines
/// that start with % or # are comments. \throws UserError (kBadInput)
GroundTruth load_ground_truth(const std::string& file);

/// Reads what --ground-truth names: a file, as "topic:/odom" the poses of a topic of the log, or as "tf:map" those of
/// the robot in a frame of the log's transforms. \param label of the laser whose robot it is
/// \param damage of the log as far as it is known, see logs::read_poses_of_topic()
/// \return without a frame if that is not known: it is taken for that of the map
/// \throws UserError (kBadInput), logs::LogError
logs::PosesInFrame read_ground_truth(
    const std::string& name, const std::string& log, const std::string& label, const std::string& damage);

/// Ground truth by the clock of the log.
struct AlignedTruth
{
	GroundTruth lines;             //!< those of the file or, if some were interpolated, one for each frame
	std::size_t interpolated = 0;  //!< [-] lines that were made between two of the file
	double offset = 0;             //!< [s] that the ground truth's clock is ahead of the log's; it has been taken off
	bool is_in_degrees = false;    //!< whether headings are beyond a turn, and agree with the frames only as degrees
};

/// Gives a pose of the ground truth to each frame that no line is within 1 ms of, but two lines at most kGreatestGap
/// apart are before and after. It looks first for the offset between the two clocks, of up to 5 s, at which the ground
/// truth fits to the poses of the localized frames; that counts only if the errors are less than half of those without.
AlignedTruth align_truth(const GroundTruth& truth, const std::vector<KeptFrame>& frames);
}  // namespace d2s1r::app
