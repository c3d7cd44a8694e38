// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/shared_surface.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/math/TPoint2D.h>

#include <algorithm>
#include <cmath>

namespace d2s1r
{
namespace
{
using mrpt::math::TPoint2D;
using mrpt::math::TPose2D;

// Two returns of one surface lie so far apart: beams end beside each other, and the motion between the scans errs.
constexpr double kApart = 0.25;                       // [m]
constexpr double kApartByRange = mrpt::DEG2RAD(1.5);  // [-] of the range
constexpr std::size_t kMostReturns = 90;              // [-] that are looked up

TPoint2D end_of(const Beam& beam)
{
	const auto angle = static_cast<double>(beam.angle), range = static_cast<double>(beam.range);
	return {range * std::cos(angle), range * std::sin(angle)};
}

/// Returns whether a scan has a return near a point of its sensor frame [m].
bool shows(const Scan& scan, const TPoint2D& point)
{
	const double range = point.norm(), reach = kApart + kApartByRange * range;
	const double width = range > reach ? std::asin(reach / range) : M_PI;  // [rad] to a side
	const double angle = std::atan2(point.y, point.x);
	const auto is_near = [&](const Beam& beam) { return beam.is_return && (end_of(beam) - point).norm() < reach; };
	const auto is_before = [](const Beam& beam, double at) { return static_cast<double>(beam.angle) < at; };
	const auto shows_between = [&](double from, double to)
	{
		const auto first = std::lower_bound(scan.beams.begin(), scan.beams.end(), from, is_before);
		return std::any_of(first, std::lower_bound(first, scan.beams.end(), to, is_before), is_near);
	};
	const double turns[] = {0, 2 * M_PI, -2 * M_PI};  // [rad] angles of beams are in [-pi, pi)
	return std::any_of(
	    std::begin(turns), std::end(turns),
	    [&](double turn) { return shows_between(angle - width + turn, angle + width + turn); });
}
}  // namespace

double share_seen_again(const Scan& scan, const Scan& other, const TPose2D& other_robot)
{
	const TPose2D other_sensor = other_robot + other.sensor_on_robot;  // robot of `scan`
	const std::size_t step = 1 + scan.beams.size() / kMostReturns;
	double returns = 0, seen = 0;
	for (std::size_t i = 0; i < scan.beams.size(); i += step)
	{
		if (!scan.beams[i].is_return) continue;
		const TPoint2D end = scan.sensor_on_robot.composePoint(end_of(scan.beams[i]));
		returns++;
		seen += shows(other, other_sensor.inverseComposePoint(end)) ? 1 : 0;
	}
	return returns > 0 ? seen / returns : 1;
}
}  // namespace d2s1r
