// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/scan.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

namespace d2s1r
{
Scan make_scan(const mrpt::obs::CObservation2DRangeScan& observation, const ScanParameters& parameters)
{
	Scan scan;
	const auto& pose = observation.sensorPose;
	const double tilt = std::acos(std::min(1.0, std::abs(std::cos(pose.pitch()) * std::cos(pose.roll()))));
	if (tilt > parameters.max_tilt * M_PI / 180)
	{
		scan.invalid_because = "the sensor is tilted";
		return scan;
	}
	const bool upside_down = std::cos(pose.pitch()) * std::cos(pose.roll()) < 0;
	scan.sensor_on_robot = {pose.x(), pose.y(), pose.yaw()};

	const std::size_t n = observation.getScanSize();
	for (std::size_t i = 0; i < n; i++)
	{
		const float range = observation.getScanRange(i);
		const bool beyond = range >= observation.maxRange;  // also +inf
		if (std::isnan(range) || range <= 0 || (!observation.getScanRangeValidity(i) && !beyond)) continue;
		const float angle = (upside_down ? -1.0F : 1.0F) * observation.getScanAngle(i);
		scan.beams.push_back({mrpt::math::wrapToPi(angle), std::min(range, observation.maxRange), !beyond});
	}
	std::sort(scan.beams.begin(), scan.beams.end(), [](const Beam& a, const Beam& b) { return a.angle < b.angle; });
	scan.field_of_view = std::min(
	    2 * M_PI, static_cast<double>(observation.aperture) * static_cast<double>(n) / static_cast<double>(n - 1));
	if (scan.beams.size() < static_cast<std::size_t>(parameters.min_beams))
		scan.invalid_because = "too few usable beams";
	return scan;
}
}  // namespace d2s1r
