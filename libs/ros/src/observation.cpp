// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/observation.h"

#include <mrpt/system/datetime.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace d2s1r::ros
{
namespace
{
/// [rad] from the first beam to the last, below zero if clockwise.
double turned_angle(const LaserScan& scan)
{
	return static_cast<double>(scan.angle_step) * (static_cast<double>(scan.ranges.size()) - 1);
}
}  // namespace

std::pair<double, double> SweepTime::span() const
{
	return std::minmax({0.0, first_beam, first_beam + duration});
}

SweepTime SweepTime::checked() const
{
	constexpr double kLongestSweep = 4;  // [s]
	return std::max(std::abs(duration), std::abs(first_beam)) < kLongestSweep ? *this : SweepTime();
}

mrpt::Clock::time_point to_time(Time time)
{
	return mrpt::Clock::fromDouble(0) + mrpt::Clock::duration(time / 100);
}

Time from_time(mrpt::Clock::time_point time)
{
	constexpr std::uint64_t kMost = std::numeric_limits<Time>::max() / 100;  // [ticks]
	// A damaged log may hold any number, so that the difference may be out of range: unsigned numbers wrap around.
	const auto ticks = static_cast<std::uint64_t>(time.time_since_epoch().count()) -
	                   static_cast<std::uint64_t>(mrpt::Clock::fromDouble(0).time_since_epoch().count());
	return time == INVALID_TIMESTAMP || ticks > kMost ? 0 : 100 * static_cast<Time>(ticks);
}

double middle_angle(const LaserScan& scan)
{
	const double middle = static_cast<double>(scan.first_angle) + turned_angle(scan) / 2;
	return std::isfinite(middle) ? middle : 0;
}

SweepTime sweep_time_of(const LaserScan& scan)
{
	const auto steps = static_cast<double>(std::max<std::size_t>(scan.ranges.size(), 1) - 1);
	return SweepTime{static_cast<double>(scan.time_step) * steps, 0}.checked();
}

RangeScan to_scan(const LaserScan& scan, const mrpt::poses::CPose3D& laser)
{
	RangeScan read;
	read.right_to_left = !(scan.angle_step < 0);  // nor if it is NaN
	read.max_range = scan.max_range;
	read.aperture = static_cast<float>(std::abs(turned_angle(scan)));
	if (!std::isfinite(scan.first_angle)) read.aperture = scan.first_angle;  // which make_scan() refuses
	read.sensor_on_robot = laser + mrpt::poses::CPose3D(0, 0, 0, middle_angle(scan), 0, 0);
	read.ranges = scan.ranges;
	for (const float range : read.ranges)  // may be NaN or infinite
	{
		const bool is_too_near = range < scan.min_range && scan.min_range < scan.max_range;
		read.valid.push_back(range > 0 && !is_too_near && range <= scan.max_range ? 1 : 0);
	}
	return read;
}
}  // namespace d2s1r::ros
