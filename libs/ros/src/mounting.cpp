// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/mounting.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>

namespace d2s1r::ros
{
using mrpt::poses::CPose3D;

namespace
{
constexpr double kWholeTurn = 2 * M_PI * 1.01;   // [rad] with what drivers add
constexpr double kAlmostFull = 2 * M_PI * 0.97;  // [rad] beyond which the first beams look where the last ones do

/// The angles of a message as they stand there, in whatever unit.
struct StatedAngles
{
	double first, last;   //!< angle_min, angle_max
	double step, turned;  //!< angle_increment, and what it makes of all beams

	explicit StatedAngles(const LaserScan& scan)
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
	return std::abs(angle) > kLeast && std::abs(angle) <= kWholeTurn;
}

bool are_equal(double a, double b)
{
	constexpr double kShare = 0.02;  // [-]
	return std::abs(a - b) < kShare * std::max(std::abs(a), std::abs(b));
}

/// Returns the angles if some of the fields are in degrees.
std::optional<OtherAngles> angles_in_degrees(const StatedAngles& angles)
{
	const bool are_ends_large = std::max(std::abs(angles.first), std::abs(angles.last)) > kWholeTurn;
	const bool is_step_large = std::abs(angles.turned) > kWholeTurn, are_all = are_ends_large && is_step_large;
	const double of_ends = are_ends_large ? mrpt::DEG2RAD(1.0) : 1, of_step = is_step_large ? mrpt::DEG2RAD(1.0) : 1;
	const double first = of_ends * angles.first, turned = of_step * angles.turned;
	if (!are_ends_large && !is_step_large) return std::nullopt;
	if (!is_field_of_view(turned) || !(are_all || are_equal(of_ends * angles.stated(), turned))) return std::nullopt;
	return OtherAngles{
	    are_all          ? "angle_min, angle_max and angle_increment are in degrees"
	    : are_ends_large ? "angle_min and angle_max are in degrees"
	                     : "angle_increment is in degrees",
	    {first, first + turned}};
}
}  // namespace

bool has_field_of_view(const LaserScan& scan)
{
	const StatedAngles angles(scan);
	return angles.are_finite() && (scan.ranges.size() < 2 || is_field_of_view(angles.turned));
}

std::optional<OtherAngles> other_angles_of(const LaserScan& scan)
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

Overrides Mounting::over(Overrides given) const
{
	const auto take = [](auto& to, const auto& from) { to = from ? from : to; };
	take(given.sensor_pose, overrides.sensor_pose);
	take(given.beam_angles, overrides.beam_angles);
	take(given.min_range, overrides.min_range);
	return given;
}

namespace
{
/// Returns up to where [m] the robot sees itself: beams that measure the same in all scans of a drive, and least; 0 if
/// there are few of them.
double own_body_in(const std::vector<std::shared_ptr<const RangeScan>>& scans)
{
	constexpr std::size_t kFewestScans = 6, kShare = 20;  // [-], of the beams at least one in so many
	constexpr double kSame = 0.04;                        // [m] by which such a beam may differ
	if (scans.size() < kFewestScans) return 0;
	const std::size_t beams = scans.front()->size();
	std::size_t own = 0;
	double farthest = 0;
	for (std::size_t i = 0; i < beams; i++)
	{
		double least = HUGE_VAL, most = 0;
		for (const auto& scan : scans)
		{
			const bool is_there = i < scan->size() && scan->is_valid(i);
			const double range = is_there ? static_cast<double>(scan->ranges[i]) : HUGE_VAL;
			least = std::min(least, range), most = std::max(most, range);
		}
		if (most - least < kSame) own++, farthest = std::max(farthest, most);
	}
	return own * kShare > beams ? std::ceil(100 * farthest + 2) / 100 : 0;
}

/// Returns whether the plane of a laser, which may be upside down, is not that of the robot.
bool is_tilted(const CPose3D& laser)
{
	constexpr double kTilt = mrpt::DEG2RAD(5);  // [rad]
	return std::abs(laser.getRotationMatrix()(2, 2)) < std::cos(kTilt);
}
}  // namespace

std::vector<Mounting> other_mountings(
    const std::vector<std::shared_ptr<const RangeScan>>& scans, const CPose3D& laser, bool is_laser_doubtful,
    const std::optional<OtherAngles>& angles, const Overrides& given)
{
	std::vector<Mounting> mountings;
	const auto add = [&](const std::string& text) -> Overrides& {
		return mountings.emplace_back(Mounting{{}, text}).overrides;
	};
	CPose3D told = laser;  // MRPT computes its angles in place
	const CPose3D level(told.x(), told.y(), told.z(), told.yaw(), 0, 0), upside_down(0, 0, 0, 0, 0, M_PI);
	if (!given.sensor_pose)
		add("scans are mirrored, by how the laser is mounted or by the image of the map").sensor_pose =
		    laser + upside_down;
	if (!given.sensor_pose && (is_laser_doubtful || is_tilted(laser)))
	{
		const CPose3D ahead_in_optical(mrpt::math::CQuaternionDouble(0.5, 0.5, -0.5, 0.5), 0, 0, 0);
		if (!is_tilted(laser + ahead_in_optical))
			add("the frame of the scans is an optical frame (z ahead) and their beams are not").sensor_pose =
			    laser + ahead_in_optical;
		add("the laser is level, and not tilted as its frame is").sensor_pose = level;
		add("the laser is level, and its scans are mirrored").sensor_pose = level + upside_down;
	}
	if (const double own = own_body_in(scans); own > 0 && !given.min_range)
		add(mrpt::format("beams that see the same below %g m in all scans are the robot itself", own)).min_range = own;
	if (angles && !given.beam_angles)
		add(angles->is_possible ? "angle_min and angle_max are right (" + angles->because + ")" : angles->because)
		    .beam_angles = angles->angles;
	return mountings;
}

Mounting best_of(
    const std::vector<Mounting>& mountings, const std::vector<std::size_t>& found_by, std::size_t scans,
    std::size_t as_told)
{
	Mounting best;
	std::size_t most = as_told + std::max<std::size_t>(2, as_told / 2);
	for (std::size_t i = 0; i < mountings.size(); i++)
		if (4 * found_by[i] >= scans && found_by[i] > most) best = mountings[i], most = found_by[i];
	return best;
}
}  // namespace d2s1r::ros
