// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/scan.h>
#include <d2s1r/scan_defect.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

#include "scan/readings.h"
#include "scan/sweep.h"

namespace d2s1r
{
namespace
{
constexpr double kFullTurn = 2 * M_PI;
constexpr std::size_t kMostBeams = 100'000;  // [-] of a scan; no laser has a tenth, and each takes time
constexpr const char* kTooManyBeams = "the scan has more than 100,000 beams";
constexpr const char* kNotOnRobot = "the pose of the sensor on the robot is not finite or more than 100 m away";

/// Returns whether a sensor at (x, y) [m] in the robot frame can be part of a robot.
bool is_on_robot(double x, double y)
{
	return std::hypot(x, y) <= kFarthestSensor;
}

/// Returns the greatest tilt [rad] of the sensor's plane against the plane of the robot during the scan.
double tilt_of(const RangeScan& observation)
{
	const auto& axes = observation.sensor_on_robot.getRotationMatrix();
	return std::atan2(std::hypot(axes(2, 0), axes(2, 1)), std::abs(axes(2, 2))) + std::abs(observation.delta_pitch);
}

struct Refusal
{
	ScanDefect defect = ScanDefect::kNone;
	std::string because{};  //!< for people
};

Refusal refusal_of(const RangeScan& observation, const ScanParameters& parameters, const Sweep& sweep)
{
	if (observation.size() < 2) return {ScanDefect::kOther, "the scan has fewer than 2 beams"};
	if (observation.size() > kMostBeams) return {ScanDefect::kOther, kTooManyBeams};
	if (!(observation.aperture > 0) || !std::isfinite(observation.aperture))
		return {ScanDefect::kAngles, "the aperture (angle_increment of ROS times the beams) is not finite and above 0"};
	if (static_cast<double>(observation.aperture) > 2 * kFullTurn)
		return {
		    ScanDefect::kAngles,
		    "the aperture (angle_increment of ROS times the beams) is more than two turns; angles are in rad"};
	if (!(observation.max_range > 0) || !std::isfinite(observation.max_range))
		return {ScanDefect::kMaxRange, "maxRange (range_max of ROS) is not finite and above 0"};
	const auto& pose = observation.sensor_on_robot;
	const auto& axes = pose.getRotationMatrix();  // yaw() would write to the observation
	const double tilt = mrpt::RAD2DEG(tilt_of(observation));
	if (!std::isfinite(tilt + axes(0, 0) + axes(1, 0)) || !is_on_robot(pose.x(), pose.y()))
		return {ScanDefect::kSensorPose, kNotOnRobot};
	if (tilt > parameters.max_tilt)
		return {
		    ScanDefect::kSensorPose,
		    "the sensor is tilted by " + std::to_string(std::lround(tilt)) + " deg, more than scan.max_tilt"};
	if (!is_usable(sweep, observation.size()))
		return {
		    ScanDefect::kOther,
		    "the sweep has times or poses that are not finite or in order, or lasts longer than 10 s"};
	return {};
}

Refusal refusal_of(const std::vector<Beam>& beams, const ScanParameters& parameters)
{
	if (beams.size() < static_cast<std::size_t>(parameters.min_beams))
		return {ScanDefect::kFewBeams, "fewer usable beams than scan.min_beams"};
	if (std::none_of(beams.begin(), beams.end(), [](const Beam& beam) { return beam.is_return; }))
		return {ScanDefect::kNoReturns, "no beam hit anything"};
	return {};
}

/// Returns the usable beams, counter-clockwise as seen from above, by increasing angle.
std::vector<Beam> usable_beams(const Readings& readings, double step, const BeamMover& mover)
{
	std::vector<Beam> beams;
	beams.reserve(readings.size());
	for (std::size_t i = 0; i < readings.size(); i++)
	{
		if (static_cast<double>(i) * step > kFullTurn - step / 2) break;  // this beam looks where the first one looked
		if (readings[i]) beams.push_back(mover.moved(*readings[i], i));
	}
	std::sort(beams.begin(), beams.end(), [](const Beam& a, const Beam& b) { return a.angle < b.angle; });
	return beams;
}

bool is_field_of_view(double angle)
{
	constexpr double kRounding = 1e-6;  // [rad]
	return angle > 0 && angle <= 2 * M_PI + kRounding;
}

/// Returns whether beams are as Scan::beams says; equal angles are in order, too.
bool are_in_order(const std::vector<Beam>& beams)
{
	float least = -static_cast<float>(M_PI);
	for (const Beam& beam : beams)
	{
		if (!(beam.angle >= least && beam.range >= 0 && std::isfinite(beam.range))) return false;
		least = beam.angle;
	}
	return least < static_cast<float>(M_PI);
}
}  // namespace

float beam_angle(double angle)
{
	const auto wrapped = static_cast<float>(mrpt::math::wrapToPi(angle));
	return wrapped >= static_cast<float>(M_PI) ? -static_cast<float>(M_PI) : wrapped;
}

bool Scan::valid() const
{
	const auto& sensor = sensor_on_robot;
	return invalid_because.empty() && !beams.empty() && beams.size() <= kMostBeams && is_field_of_view(field_of_view) &&
	       is_on_robot(sensor.x, sensor.y) && std::isfinite(sensor.phi) && are_in_order(beams);
}

std::string why_invalid(const Scan& scan)
{
	if (!scan.invalid_because.empty()) return scan.invalid_because;
	if (scan.beams.empty()) return "the scan has no beams";
	if (scan.beams.size() > kMostBeams) return kTooManyBeams;
	if (!is_field_of_view(scan.field_of_view)) return "the field of view of the scan is not above 0 and at most 2 pi";
	if (!are_in_order(scan.beams))
		return "the beams of the scan are not by increasing angle in [-pi, pi), with finite ranges of at least 0";
	return kNotOnRobot;
}

mrpt::math::CMatrixDouble33 motion_covariance(const Scan& scan)
{
	auto covariance = mrpt::math::CMatrixDouble33::Zero();
	covariance(0, 0) = covariance(1, 1) = scan.position_std * scan.position_std;
	covariance(2, 2) = scan.heading_std * scan.heading_std;
	return covariance;
}

bool is_covered(const Scan& scan, const ScanParameters& parameters)
{
	const auto is_blocked = [&](const Beam& beam)
	{ return beam.is_return && static_cast<double>(beam.range) < parameters.covered_within; };
	const auto blocked = std::count_if(scan.beams.begin(), scan.beams.end(), is_blocked);
	return 10 * static_cast<std::size_t>(blocked) >= 9 * scan.beams.size();
}

Scan make_scan(const RangeScan& observation, const ScanParameters& parameters, const Sweep& sweep)
{
	Scan scan;
	scan.invalid_because = refusal_of(observation, parameters, sweep).because;
	if (!scan.invalid_because.empty()) return scan;

	const BeamMover mover(observation, sweep);
	scan.sensor_on_robot = mover.sensor_on_robot();
	scan.position_std = mover.motion().position_std();
	scan.heading_std = mover.motion().heading_std();
	const double step = static_cast<double>(observation.aperture) / static_cast<double>(observation.size() - 1);
	Readings readings = read_each(observation, parameters);
	scan.repeated = take_out_repeated(readings);
	scan.lost = take_out_lost(readings, step, parameters);
	scan.beams = usable_beams(readings, step, mover);
	scan.field_of_view = std::min(kFullTurn, step * static_cast<double>(scan.beams.size()));
	scan.invalid_because = refusal_of(scan.beams, parameters).because;
	return scan;
}

ScanDefect defect_of(const RangeScan& observation, const ScanParameters& parameters, const Sweep& sweep)
{
	const Refusal refusal = refusal_of(observation, parameters, sweep);
	if (refusal.defect != ScanDefect::kNone) return refusal.defect;
	return refusal_of(make_scan(observation, parameters, sweep).beams, parameters).defect;
}
}  // namespace d2s1r
