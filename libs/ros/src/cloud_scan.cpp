// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "ros/observation.h"

namespace d2s1r::ros
{
namespace
{
constexpr std::size_t kDirections = 1440;
constexpr double kNearest = 0.05, kFarthest = 200;  // [m]
constexpr double kStep = 2 * M_PI / kDirections;    // [rad]

struct SeenPoint
{
	double angle = 0;  //!< [rad] from the x axis of the robot, counter-clockwise
	double range = 0;  //!< [m]
	double time = 0;   //!< [s]
};

std::vector<SeenPoint> points_in_band(
    const PointCloud& cloud, const mrpt::poses::CPose3D& sensor, const HeightBand& band)
{
	std::vector<SeenPoint> seen;
	for (const CloudPoint& point : cloud.points)
	{
		const auto on_robot = sensor.composePoint(
		    {static_cast<double>(point.x), static_cast<double>(point.y), static_cast<double>(point.z)});
		const double x = on_robot.x - sensor.x(), y = on_robot.y - sensor.y(), range = std::hypot(x, y);
		if (!(on_robot.z >= band.from && on_robot.z <= band.to && range >= kNearest && range < kFarthest)) continue;
		seen.push_back({std::atan2(y, x), range, static_cast<double>(point.time)});
	}
	return seen;
}

/// Where a laser looks that spins: at a time [s], at the angle first + (time - start) / time_per_angle.
struct Spin
{
	double first = 0;           //!< [rad] on the robot
	double start = 0;           //!< [s]
	double time_per_angle = 0;  //!< [s / rad] below zero: clockwise
};

/// Fits a spin to one direction of rotation, 1 or -1. Returns how far [s] the times are off it (standard deviation).
double fit_spin(const std::vector<SeenPoint>& points, int direction, double duration, Spin& spin)
{
	constexpr int kRounds = 3;  // to find the turn that each point belongs to
	const auto count = static_cast<double>(points.size());
	double farthest = 0;  // [rad]
	const auto swept = [&](const SeenPoint& point)
	{
		const double turns = direction * (point.angle - spin.first) / (2 * M_PI);
		return 2 * M_PI * (turns - std::floor(turns));
	};
	for (const SeenPoint& point : points) farthest = std::max(farthest, swept(point));
	double slope = duration / std::max(farthest, 0.1), deviation = duration;  // [s / rad], [s]
	for (int round = 0; round < kRounds; round++)
	{
		double angles = 0, times = 0, squares = 0, products = 0, residuals = 0;
		const auto in_turn = [&](const SeenPoint& point)  // the first and the last points lie beside each other
		{
			const double angle = swept(point);
			return angle + 2 * M_PI * std::round((point.time - spin.start - slope * angle) / (2 * M_PI * slope));
		};
		for (const SeenPoint& point : points) angles += in_turn(point) / count, times += point.time / count;
		for (const SeenPoint& point : points)
		{
			const double off = in_turn(point) - angles;
			squares += off * off;
			products += off * (point.time - times);
		}
		const double fitted = products / squares;
		if (!(fitted > 0)) return duration;
		for (const SeenPoint& point : points)
		{
			const double off = point.time - times - fitted * (in_turn(point) - angles);
			residuals += off * off / count;
		}
		slope = fitted;
		spin.start = times - fitted * angles;
		deviation = std::sqrt(residuals);
	}
	spin.time_per_angle = direction * slope;
	return deviation;
}

/// Returns no value if the times of the points are the same, or not those of a laser that spins.
std::optional<Spin> spin_of(const std::vector<SeenPoint>& points)
{
	constexpr std::size_t kFewest = 50;  // [-] points
	constexpr double kShortestTurn = 1e-3, kLongestTurn = 1,
	                 kMostNoise = 0.05;  // [s], [s] of a turn, [-] of the duration
	if (points.size() < kFewest) return std::nullopt;
	const auto earlier = [](const SeenPoint& a, const SeenPoint& b) { return a.time < b.time; };
	const auto [first, last] = std::minmax_element(points.begin(), points.end(), earlier);
	const double duration = last->time - first->time;
	if (!(duration >= kShortestTurn && duration <= kLongestTurn)) return std::nullopt;
	Spin left{first->angle, first->time}, right = left;
	const double off_left = fit_spin(points, 1, duration, left), off_right = fit_spin(points, -1, duration, right);
	if (!(std::min(off_left, off_right) < kMostNoise * duration)) return std::nullopt;
	const Spin& spin = off_left < off_right ? left : right;
	if (2 * M_PI * std::abs(spin.time_per_angle) > kLongestTurn) return std::nullopt;
	return spin;
}
}  // namespace

CloudScan to_scan(const PointCloud& cloud, const mrpt::poses::CPose3D& sensor, const HeightBand& band)
{
	const std::vector<SeenPoint> points = points_in_band(cloud, sensor, band);
	const std::optional<Spin> spin = spin_of(points);
	const double heading = std::atan2(sensor.getRotationMatrix()(1, 0), sensor.getRotationMatrix()(0, 0));
	const int turn = spin && spin->time_per_angle < 0 ? -1 : 1;
	const double start = spin ? spin->first : heading - M_PI;  // [rad] where the first direction begins
	std::vector<double> nearest(kDirections, kFarthest);       // [m]
	for (const SeenPoint& point : points)
	{
		const double turns = turn * (point.angle - start) / (2 * M_PI);
		const auto direction = static_cast<std::size_t>((turns - std::floor(turns)) * kDirections) % kDirections;
		nearest[direction] = std::min(nearest[direction], point.range);
	}
	RangeScan scan;
	scan.right_to_left = turn > 0;
	scan.max_range = static_cast<float>(kFarthest);
	scan.aperture = static_cast<float>(2 * M_PI - kStep);
	scan.sensor_on_robot = {sensor.x(), sensor.y(), sensor.z(), start + turn * M_PI, 0, 0};
	for (const double range : nearest)
	{
		const bool has_point = range < kFarthest;
		scan.ranges.push_back(has_point ? static_cast<float>(range) : std::nanf(""));
		scan.valid.push_back(has_point ? 1 : 0);
	}
	if (!spin) return {std::move(scan), {}};
	const double per_beam = std::abs(spin->time_per_angle) * kStep;  // [s]
	return {std::move(scan), {per_beam * (kDirections - 1), spin->start + per_beam / 2}};
}

SweepTime time_span_of(const PointCloud& cloud)
{
	if (cloud.points.empty()) return {};
	const auto earlier = [](const CloudPoint& a, const CloudPoint& b) { return a.time < b.time; };
	const auto [first, last] = std::minmax_element(cloud.points.begin(), cloud.points.end(), earlier);
	const auto start = static_cast<double>(first->time);
	return {static_cast<double>(last->time) - start, start};
}
}  // namespace d2s1r::ros
