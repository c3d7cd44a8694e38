// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/CSignatureMap2D.h>
#include <mrpt/math/TPose2D.h>

#include <optional>
#include <string>
#include <vector>

namespace d2s1r::experiments
{
/// A scan of a run with what is known of it.
struct RunFrame
{
	mrpt::obs::CObservation2DRangeScan::Ptr scan;
	std::optional<mrpt::poses::CPose2D> odometry;  //!< raw reading
	mrpt::math::TPose2D truth;                     //!< robot in map, m and rad
	bool has_truth = true;                         //!< whether it is known
	Localization localization;                     //!< of the scan alone

	bool is_near(const mrpt::math::TPose2D& pose) const;  //!< within 0.5 m and 10 deg of truth

	/// The same, of where the scan itself fits the map near the truth: ground truth made by SLAM is off here and there.
	bool is_near_on_map(const mrpt::math::TPose2D& pose, const CSignatureMap2D& map) const;
};

/// Every scan of the first laser of a log with its odometry and the line of ground truth of its time, within 1 ms.
/// \throws std::runtime_error if a file cannot be read or no line is of a scan
std::vector<RunFrame> load_run(const std::string& log, const std::string& ground_truth);

/// Makes the readings of wheels of the ground truth: they are off by 5 % of the way and of the turn, and by 1 deg a
/// metre, as standard deviations.
void make_odometry(std::vector<RunFrame>& run, unsigned seed);

/// Makes each motion of the odometry `scale` [-] times as long, and turns it by an error whose standard deviation is
/// `yaw_noise` [deg].
void disturb_odometry(std::vector<RunFrame>& run, double scale, double yaw_noise);

/// Localizes all scans, with two threads, or reads what an earlier call wrote to `cache_file` (it is up to the caller
/// to delete it when map, run or localizer change).
/// \param cache_file empty: nothing is kept
void localize_all(std::vector<RunFrame>& run, const Localizer& localizer, const std::string& cache_file);
}  // namespace d2s1r::experiments
