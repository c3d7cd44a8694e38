// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Messages of ROS as MRPT's observations.
#pragma once

#include "ros/messages.h"

#include <mrpt/core/Clock.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/poses/CPose3D.h>

#include <cstdint>
#include <string>

namespace d2s1r::ros
{
/// Returns a time of ROS [ns since the epoch] as MRPT holds it, to 100 ns.
mrpt::Clock::time_point to_time(std::int64_t nanoseconds);

/// Returns the angle [rad] of the middle of the beams, in the frame of the laser.
double middle_angle(const LaserScan& scan);

/// Returns the scan as MRPT has it, whose scans are symmetric to the x axis of the sensor. Readings that are NaN,
/// infinite, or outside of the laser's range are invalid; those above its range keep their value.
/// \param laser its frame on the robot
mrpt::obs::CObservation2DRangeScan::Ptr to_observation(
    const LaserScan& scan, const mrpt::poses::CPose3D& laser, const std::string& label);

/// Returns the odometry as MRPT has it; null if the message holds no pose.
mrpt::obs::CObservationOdometry::Ptr to_observation(const Odometry& odometry, const std::string& label);
}  // namespace d2s1r::ros
