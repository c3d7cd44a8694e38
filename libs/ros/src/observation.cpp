// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/observation.h"

#include <algorithm>
#include <cmath>

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
	constexpr double kLongest = 4;  // [s]
	return std::max(std::abs(duration), std::abs(first_beam)) < kLongest ? *this : SweepTime();
}

mrpt::Clock::time_point to_time(std::int64_t nanoseconds)
{
	return mrpt::Clock::fromDouble(0) + mrpt::Clock::duration(nanoseconds / 100);
}

double middle_angle(const LaserScan& scan)
{
	const double middle = static_cast<double>(scan.first_angle) + turned_angle(scan) / 2;
	return std::isfinite(middle) ? middle : 0;
}

SweepTime sweep_time_of(const LaserScan& scan)
{
	const auto steps = static_cast<double>(std::max<std::size_t>(scan.ranges.size(), 1) - 1);
	return {static_cast<double>(scan.time_step) * steps, 0};
}

mrpt::obs::CObservation2DRangeScan::Ptr to_observation(
    const LaserScan& scan, const mrpt::poses::CPose3D& laser, const std::string& label)
{
	auto observation = mrpt::obs::CObservation2DRangeScan::Create();
	observation->timestamp = to_time(scan.header.time);
	observation->sensorLabel = label;
	observation->rightToLeft = !(scan.angle_step < 0);  // nor if it is NaN
	observation->maxRange = scan.max_range;
	observation->aperture = static_cast<float>(std::abs(turned_angle(scan)));
	if (!std::isfinite(scan.first_angle)) observation->aperture = scan.first_angle;  // which make_scan() refuses
	observation->sensorPose = laser + mrpt::poses::CPose3D(0, 0, 0, middle_angle(scan), 0, 0);
	const std::size_t beams = scan.ranges.size();
	observation->resizeScan(beams);
	for (std::size_t i = 0; i < beams; i++)
	{
		const float range = scan.ranges[i];  // may be NaN or infinite
		observation->setScanRange(i, range);
		const bool is_too_near = range < scan.min_range && scan.min_range < scan.max_range;
		observation->setScanRangeValidity(i, range > 0 && !is_too_near && range <= scan.max_range);
	}
	return observation;
}

mrpt::obs::CObservation2DRangeScan::Ptr to_observation(
    const PointCloud& cloud, const mrpt::poses::CPose3D& sensor, const HeightBand& band, const std::string& label)
{
	constexpr std::size_t kDirections = 1440;
	constexpr double kNearest = 0.05, kFarthest = 200;  // [m]
	constexpr double kStep = 2 * M_PI / kDirections;    // [rad]
	const double heading = std::atan2(sensor.getRotationMatrix()(1, 0), sensor.getRotationMatrix()(0, 0));
	std::vector<double> nearest(kDirections, kFarthest);  // [m]
	for (const CloudPoint& point : cloud.points)
	{
		const auto on_robot = sensor.composePoint(
		    {static_cast<double>(point.x), static_cast<double>(point.y), static_cast<double>(point.z)});
		const double x = on_robot.x - sensor.x(), y = on_robot.y - sensor.y(), range = std::hypot(x, y);
		if (!(on_robot.z >= band.from && on_robot.z <= band.to && range >= kNearest && range < kFarthest)) continue;
		const double turns = (std::atan2(y, x) - heading + M_PI) / (2 * M_PI);
		const auto direction = static_cast<std::size_t>((turns - std::floor(turns)) * kDirections) % kDirections;
		nearest[direction] = std::min(nearest[direction], range);
	}
	auto observation = mrpt::obs::CObservation2DRangeScan::Create();
	observation->timestamp = to_time(cloud.header.time);
	observation->sensorLabel = label;
	observation->rightToLeft = true;
	observation->maxRange = static_cast<float>(kFarthest);
	observation->aperture = static_cast<float>(2 * M_PI - kStep);
	observation->sensorPose = {sensor.x(), sensor.y(), sensor.z(), heading, 0, 0};
	observation->resizeScan(kDirections);
	for (std::size_t i = 0; i < kDirections; i++)
	{
		const bool has_point = nearest[i] < kFarthest;
		observation->setScanRange(i, has_point ? static_cast<float>(nearest[i]) : std::nanf(""));
		observation->setScanRangeValidity(i, has_point);
	}
	return observation;
}

mrpt::obs::CObservationOdometry::Ptr to_observation(const Odometry& odometry, const std::string& label)
{
	if (!odometry.pose.pose) return nullptr;
	auto observation = mrpt::obs::CObservationOdometry::Create();
	observation->timestamp = to_time(odometry.pose.header.time);
	observation->sensorLabel = label;
	observation->odometry = mrpt::poses::CPose2D(*odometry.pose.pose);
	observation->hasVelocities = true;
	observation->velocityLocal = odometry.velocity;
	return observation;
}
}  // namespace d2s1r::ros
