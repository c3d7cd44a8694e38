// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/overrides.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/core/format.h>
#include <mrpt/math/wrap2pi.h>

#include <cmath>

namespace d2s1r::ros
{
using mrpt::poses::CPose2D;
using mrpt::poses::CPose3D;

void apply(const Overrides& overrides, double middle_angle, RangeScan& scan)
{
	if (overrides.sensor_pose) scan.sensor_on_robot = *overrides.sensor_pose + CPose3D(0, 0, 0, middle_angle, 0, 0);
	if (const auto& angles = overrides.beam_angles)
	{
		scan.aperture = static_cast<float>(std::abs(angles->last - angles->first));
		scan.right_to_left = angles->last >= angles->first;
		const double middle = 0.5 * (angles->first + angles->last);
		scan.sensor_on_robot = scan.sensor_on_robot + CPose3D(0, 0, 0, middle - middle_angle, 0, 0);
	}
	scan.valid.resize(scan.size(), 1);
	const float max_range = overrides.max_range.value_or(scan.max_range);
	const auto factor = static_cast<float>(overrides.range_factor.value_or(1));
	for (std::size_t i = 0; i < scan.size(); i++)
	{
		float& range = scan.ranges[i];
		if (overrides.ignores_flags && range > 0 && range < scan.max_range) scan.valid[i] = 1;
		if (overrides.min_range && static_cast<double>(range) < *overrides.min_range) scan.valid[i] = 0;
		if (!overrides.max_range && !overrides.range_factor) continue;
		if (!(range < scan.max_range) && factor * range < max_range) scan.valid[i] = 1;
		range *= factor;
	}
	scan.max_range = max_range;
}

CPose2D odometry_as(const Overrides& overrides, const CPose2D& told)
{
	return overrides.is_odometry_mirrored ? CPose2D(told.x(), -told.y(), -told.phi()) : told;
}

std::vector<std::pair<std::string, std::string>> entries_of(const Overrides& overrides)
{
	std::vector<std::pair<std::string, std::string>> entries;
	const auto rounded = [](double value, double digits) { return std::round(value * digits) / digits + 0.0; };
	if (overrides.sensor_pose)
	{
		CPose3D pose = *overrides.sensor_pose;  // MRPT computes its angles in place
		const auto metres = [&](double length) { return rounded(length, 1e3); };
		const auto degrees = [&](double angle) { return rounded(mrpt::RAD2DEG(mrpt::math::wrapToPi(angle)), 100); };
		entries.emplace_back(
		    "sensor-pose", mrpt::format(
		                       "%g,%g,%g,%g,%g,%g", metres(pose.x()), metres(pose.y()), metres(pose.z()),
		                       degrees(pose.yaw()), degrees(pose.pitch()), degrees(pose.roll())));
	}
	if (const auto& sweep = overrides.sweep)
		entries.emplace_back(
		    "sweep-time", mrpt::format("%g", sweep->duration) +
		                      (sweep->first_beam != 0 ? mrpt::format(",%g", sweep->first_beam) : ""));
	if (overrides.range_factor) entries.emplace_back("range-factor", mrpt::format("%.6g", *overrides.range_factor));
	if (overrides.max_range)
		entries.emplace_back("max-range", mrpt::format("%g", static_cast<double>(*overrides.max_range)));
	if (const auto& angles = overrides.beam_angles)
	{
		const auto degrees = [&](double angle) { return rounded(mrpt::RAD2DEG(angle), 1e4); };
		entries.emplace_back("beam-angles", mrpt::format("%.8g,%.8g", degrees(angles->first), degrees(angles->last)));
	}
	if (overrides.min_range) entries.emplace_back("min-range", mrpt::format("%g", *overrides.min_range));
	if (overrides.ignores_flags) entries.emplace_back("ignore-flags", "");
	if (overrides.is_odometry_mirrored) entries.emplace_back("mirrored-odometry", "");
	if (overrides.odometry_clock != 0)
		entries.emplace_back("odometry-clock", mrpt::format("%.2f", overrides.odometry_clock));
	return entries;
}
}  // namespace d2s1r::ros
