// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "bags/scan_doubts.h"

#include <mrpt/core/format.h>
#include <ros/mounting.h>

#include <cmath>

namespace d2s1r::logs
{
std::vector<ScanDoubt> doubts_about_fields(const ros::LaserScan& scan)
{
	std::vector<ScanDoubt> doubts;
	const auto add = [&](const std::string& text, ScanDoubt::Field field) { doubts.push_back({text, field}); };
	if (const auto other = ros::other_angles_of(scan))
		add(other->because + (other->is_possible ? "; angle_increment is used" : ""), ScanDoubt::Field::kAngles);
	else if (!ros::has_field_of_view(scan))
		add(mrpt::format(
		        "angle_min %g, angle_increment %g and %zu ranges are no angles of a laser in rad",
		        static_cast<double>(scan.first_angle), static_cast<double>(scan.angle_step), scan.ranges.size()),
		    ScanDoubt::Field::kAngles);
	const auto min_range = static_cast<double>(scan.min_range), max_range = static_cast<double>(scan.max_range);
	if (!std::isfinite(max_range) || !(max_range > 0))
		add(mrpt::format("range_max is %g, so that no scan can be used", max_range), ScanDoubt::Field::kMaxRange);
	else if (min_range >= max_range)
		add(mrpt::format("range_min %g is not below range_max %g", min_range, max_range), ScanDoubt::Field::kMaxRange);
	if (scan.time_step != 0 && ros::sweep_time_of(scan).is_instant())
		add(mrpt::format(
		        "time_increment %g s is none of a sweep of %zu beams and is not used",
		        static_cast<double>(scan.time_step), scan.ranges.size()),
		    ScanDoubt::Field::kSweep);
	return doubts;
}
}  // namespace d2s1r::logs
