// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Messages of ROS as scans.
#pragma once

#include <d2s1r/range_scan.h>
#include <mrpt/core/Clock.h>

#include <cstdint>
#include <utility>

#include "ros/messages.h"

namespace d2s1r::ros
{
/// Says when a laser took the beams of a scan, in the order of its ranges.
struct SweepTime
{
	double duration = 0;    //!< [s] from the first beam to the last; negative: the last was taken first; 0: not known
	double first_beam = 0;  //!< [s] of the first beam, after the time of the observation

	/// Returns whether all beams were taken at the time of the observation.
	bool is_instant() const { return duration == 0 && first_beam == 0; }

	/// Returns from when to when [s] after the time of the observation the motion of the robot is needed.
	std::pair<double, double> span() const;

	/// Returns the same, or an instant one if it takes 4 s or longer, which is a mistake.
	SweepTime checked() const;
};

/// Returns a time of ROS as MRPT holds it, to 100 ns.
mrpt::Clock::time_point to_time(Time time);

/// Returns the same as ROS has it; 0 if there is no time, or one that is out of range.
Time from_time(mrpt::Clock::time_point time);

/// Returns the angle [rad] of the middle of the beams, in the frame of the laser; 0 if the angles of the scan are not
/// finite, with which no scan can be used.
double middle_angle(const LaserScan& scan);

/// Returns when the beams of a scan were taken; an instant sweep if time_increment is 0, no number, or makes 4 s or
/// more (drivers write it in ms, us or ns, or write the time of a scan there). LaserScan::scan_time does not tell it:
/// simulators that take all beams at once fill it in, too.
SweepTime sweep_time_of(const LaserScan& scan);

/// Returns the scan as the library takes it, whose scans are symmetric to the x axis of the sensor. Readings that are
/// NaN, infinite, or outside of the laser's range are invalid; those above its range keep their value.
/// \param laser its frame on the robot
RangeScan to_scan(const LaserScan& scan, const mrpt::poses::CPose3D& laser);

/// Says which points of a cloud make a scan: those between two heights [m] above the origin of the robot's frame.
struct HeightBand
{
	double from = 0, to = 0;  //!< [m] from < to
};

/// A cloud as a scan, and when its beams were taken.
struct CloudScan
{
	RangeScan scan;
	SweepTime sweep;  //!< instant if the times of the points are not those of a laser that spins
};

/// Returns a cloud as a scan of a laser that looks around level from where the sensor is: in each of 1,440 directions
/// the nearest point of the band. Directions without a point, and points within 0.05 m or beyond 200 m, are no data: a
/// cloud does not tell where a beam saw nothing. If the points have times, the first beam is the direction in which the
/// turn of the laser began. \param sensor its frame on the robot
CloudScan to_scan(const PointCloud& cloud, const mrpt::poses::CPose3D& sensor, const HeightBand& band);

/// Returns a sweep that lasts as long as all points of a cloud take.
SweepTime time_span_of(const PointCloud& cloud);
}  // namespace d2s1r::ros
