// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "bags/scan_doubts.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>

namespace d2s1r::logs
{
namespace
{
constexpr double kFullTurn = 2 * M_PI * 1.01;    // [rad] with what drivers add
constexpr double kAlmostFull = 2 * M_PI * 0.97;  // [rad] beyond which the first beams look where the last ones do

/// The angles of a message as they stand there, in whatever unit.
struct StatedAngles
{
	double first, last;   //!< angle_min, angle_max
	double step, turned;  //!< angle_increment, and what it makes of all beams

	explicit StatedAngles(const ros::LaserScan& scan)
	    : first(static_cast<double>(scan.first_angle)),
	      last(static_cast<double>(scan.last_angle)),
	      step(static_cast<double>(scan.angle_step)),
	      turned(step * (static_cast<double>(scan.ranges.size()) - 1))
	{
	}

	bool are_finite() const { return std::isfinite(first) && std::isfinite(last) && std::isfinite(step); }
	double stated() const { return last - first; }
};

bool is_field_of_view(double angle)
{
	constexpr double kLeast = 0.1;  // [rad]
	return std::abs(angle) > kLeast && std::abs(angle) <= kFullTurn;
}

bool are_equal(double a, double b)
{
	constexpr double kShare = 0.02;  // [-]
	return std::abs(a - b) < kShare * std::max(std::abs(a), std::abs(b));
}

/// Returns the angles if some of the fields are in degrees.
std::optional<OtherAngles> angles_in_degrees(const StatedAngles& angles)
{
	const double kDegree = mrpt::DEG2RAD(1.0);
	const bool are_ends_large = std::max(std::abs(angles.first), std::abs(angles.last)) > kFullTurn;
	const bool is_step_large = std::abs(angles.turned) > kFullTurn;
	if (are_ends_large && is_step_large && is_field_of_view(kDegree * angles.turned))
	{
		const double first = kDegree * angles.first;
		return OtherAngles{
		    "angle_min, angle_max and angle_increment are in degrees", {first, first + kDegree * angles.turned}};
	}
	if (are_ends_large && is_field_of_view(angles.turned) && are_equal(kDegree * angles.stated(), angles.turned))
		return OtherAngles{
		    "angle_min and angle_max are in degrees", {kDegree * angles.first, kDegree * angles.first + angles.turned}};
	if (is_step_large && is_field_of_view(angles.stated()) && are_equal(kDegree * angles.turned, angles.stated()))
		return OtherAngles{"angle_increment is in degrees", {angles.first, angles.first + kDegree * angles.turned}};
	return std::nullopt;
}
}  // namespace

std::optional<OtherAngles> other_angles_of(const ros::LaserScan& scan)
{
	constexpr double kLeastShare = 0.005;  // [-] of the field of view
	const StatedAngles angles(scan);
	if (!angles.are_finite() || scan.ranges.size() < 2) return std::nullopt;
	if (auto degrees = angles_in_degrees(angles)) return degrees;
	const double off = std::abs(angles.turned - angles.stated());
	const bool differs = off > kLeastShare * std::abs(angles.turned) && off > 1.5 * std::abs(angles.step);
	if (!differs || !is_field_of_view(angles.stated())) return std::nullopt;
	if (angles.step == 0) return OtherAngles{"angle_increment is 0", {angles.first, angles.last}};
	if (angles.step * angles.stated() < 0 && std::abs(angles.turned + angles.step) < kAlmostFull)
		return OtherAngles{
		    mrpt::format(
		        "angle_increment %g rad leads away from angle_max %g rad (its sign is wrong, or both ends are swapped)",
		        angles.step, angles.last),
		    {angles.first, angles.last}};
	return OtherAngles{
	    mrpt::format(
	        "angle_increment and %zu ranges make %.1f deg, but angle_min and angle_max %.1f deg", scan.ranges.size(),
	        mrpt::RAD2DEG(angles.turned), mrpt::RAD2DEG(angles.stated())),
	    {angles.first, angles.last},
	    true};
}

std::vector<ScanDoubt> doubts_about_fields(const ros::LaserScan& scan)
{
	std::vector<ScanDoubt> doubts;
	const StatedAngles angles(scan);
	const auto add = [&](const std::string& text, ScanDoubt::Field field) { doubts.push_back({text, field}); };
	if (const auto other = other_angles_of(scan))
		add(other->because + (other->is_possible ? "; angle_increment is used" : ""), ScanDoubt::Field::kAngles);
	else if (!angles.are_finite() || (scan.ranges.size() > 1 && !is_field_of_view(angles.turned)))
		add(mrpt::format(
		        "angle_min %g, angle_increment %g and %zu ranges are no angles of a laser in rad", angles.first,
		        angles.step, scan.ranges.size()),
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
