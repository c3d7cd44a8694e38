// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "evaluation/ground_truth.h"
#include "frames/frame_store.h"

namespace d2s1r::app
{
struct MeanStd
{
	double mean = 0;
	double deviation = 0;  //!< of the population
};

/// Returns the mean and the standard deviation, both NaN if there is no value.
MeanStd mean_std(const std::vector<double>& values);

/// Returns the value below which the given share of the values lies, NaN if there is no value.
/// \param share [-] in [0, 1]
double percentile(std::vector<double> values, double share);

/// Says how far from the truth a pose may be that still counts as right.
struct Tolerance
{
	double position = 0.3;  //!< [m]
	double yaw = 5.0;       //!< [deg]
};

/// Pairs a line of the ground truth with the frame that was taken at that time.
struct Match
{
	TimedPose truth;
	const KeptFrame* frame = nullptr;
	double position_error = 0;  //!< [m] from the truth to the best pose; infinite if the frame has no pose
	double yaw_error = 0;       //!< [deg] as above

	bool within(const Tolerance& tolerance) const
	{
		return position_error < tolerance.position && yaw_error < tolerance.yaw;
	}
};

/// Returns the errors of `pose`, which takes the place of the frame's own pose.
Match compare(const TimedPose& truth, const KeptFrame& frame, const mrpt::math::TPose2D& pose);

/// Pairs each line with the frame that is nearest in time, at most 1 ms away. Lines without such a frame are left out.
std::vector<Match> match(const std::vector<KeptFrame>& frames, const GroundTruth& truth);

/// Says how often the frames with ground truth are right, and how large the errors of the right ones are.
struct Accuracy
{
	std::size_t frames = 0;
	std::size_t successes = 0;            //!< frames whose best pose is within the tolerance, whatever their status
	std::size_t localized = 0;            //!< frames of status localized
	std::size_t localized_successes = 0;  //!< localized frames whose best pose is within the tolerance
	MeanStd position_error;               //!< [m] over the successes
	MeanStd yaw_error;                    //!< [deg] over the successes
};

Accuracy measure(const std::vector<Match>& matches, const Tolerance& tolerance);

/// Says by what the poses that were found differ from the ground truth if it is nearly always the same.
struct ConstantOffset
{
	bool is_in_map_frame = false;  //!< else it is in the frame of the robot
	mrpt::math::TPose2D offset;  //!< found pose in the frame of the true one, or map of the truth in the map, m and rad
	std::size_t frames = 0;      //!< [-] localized frames that differ by it
	std::size_t of = 0;          //!< [-] localized frames with ground truth
};

/// Returns the offset that most localized frames have, if it is more than errors of localization are: the truth of
/// another frame of the robot, such as the laser, or in another frame than the map.
std::optional<ConstantOffset> find_constant_offset(const std::vector<Match>& matches);
}  // namespace d2s1r::app
