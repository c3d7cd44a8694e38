// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "counted_map.h"

namespace d2s1r::experiments
{
/// Holds a scan of a log, where it was taken, and the odometry of the wheels in its own frame.
struct DrivenScan : PlacedScan
{
	std::optional<mrpt::poses::CPose2D> odometry;
};

/// Says how the beams of a log lie.
struct Beams
{
	double degrees_per_beam;  //!< [deg]
	double reach;             //!< [m] at which the laser says that it saw nothing
};

/// Reads the scans of a CARMEN log that a SLAM program has corrected, packed by gzip or not. Its clocks jump; scans get
/// times of their own, 0.2 s apart, in their order.
/// \throws std::runtime_error if the file cannot be read, or a line is damaged
std::vector<DrivenScan> read_corrected_log(const std::string& file, const Beams& beams);

/// Reads all scans of the same drive from a rawlog, of which `corrected` are some, and places them: at the pose of
/// `corrected` where the ranges are the same, and by the odometry between two such scans. What comes before the first
/// or after the last of these is left out.
/// \throws std::runtime_error if the file cannot be read, or lacks a scan of `corrected`
std::vector<DrivenScan> read_raw_log(
    const std::string& file, const Beams& beams, const std::vector<DrivenScan>& corrected);
}  // namespace d2s1r::experiments
