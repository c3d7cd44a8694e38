// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/wall_gain.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace d2s1r
{
bool WallGain::is_clear() const
{
	constexpr std::size_t kFewest = 5;                 // [-] scans that show something
	constexpr double kDeviations = 3, kLeast = 0.002;  // [-], [m]
	return scans >= kFewest && std::abs(gain) > kLeast && std::abs(gain) > kDeviations * deviation;
}

namespace
{
double mean_of(const std::vector<double>& values)
{
	return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}
}  // namespace

WallGain wall_gain(const std::vector<double>& before, const std::vector<double>& after)
{
	if (before.empty()) return {};
	std::vector<double> gains;
	for (std::size_t i = 0; i < before.size(); i++) gains.push_back(before[i] - after[i]);
	const double mean = mean_of(gains), count = static_cast<double>(gains.size());
	double squares = 0;
	for (const double gain : gains) squares += (gain - mean) * (gain - mean);
	return {gains.size(), mean_of(before), mean, std::sqrt(squares / count) / std::sqrt(count)};
}

double distance_to_wall(const Grid& grid, const mrpt::math::TPose2D& sensor, double direction, double most)
{
	const double step = 0.5 * grid.cell_size;
	for (double distance = 0; distance < most; distance += step)
	{
		const double x = sensor.x + distance * std::cos(direction), y = sensor.y + distance * std::sin(direction);
		const int column = static_cast<int>(std::floor((x - grid.origin_x) / grid.cell_size)),
		          row = static_cast<int>(std::floor((y - grid.origin_y) / grid.cell_size));
		if (!grid.contains(column, row)) return most;
		if (grid.at(column, row) == Cell::kOccupied) return distance;
	}
	return most;
}

namespace
{
constexpr double kFarthestWall = 0.3;  // [m] from the end of a return, that counts
}  // namespace

std::vector<double> walls_behind_returns(const Scan& scan, const mrpt::math::TPose2D& robot, const Grid& grid)
{
	const auto sensor = robot + scan.sensor_on_robot;
	std::vector<double> walls;
	for (const Beam& beam : scan.beams)
	{
		if (!beam.is_return) continue;
		const auto range = static_cast<double>(beam.range), angle = static_cast<double>(beam.angle);
		const double wall = distance_to_wall(grid, sensor, sensor.phi + angle, range + kFarthestWall);
		walls.push_back(std::clamp(wall - range, -kFarthestWall, kFarthestWall));
	}
	return walls;
}

double distance_from_walls(const Scan& scan, const mrpt::math::TPose2D& robot, const Grid& grid)
{
	const std::vector<double> walls = walls_behind_returns(scan, robot, grid);
	if (walls.empty()) return kFarthestWall;
	double sum = 0;
	for (const double wall : walls) sum += std::abs(wall);
	return sum / static_cast<double>(walls.size());
}

void WallComparison::add(const std::optional<double>& usual, const std::optional<double>& other)
{
	constexpr double kNotFound = 0.15;  // [m]
	if (!usual && !other) return;
	usual_.push_back(usual.value_or(kNotFound));
	other_.push_back(other.value_or(kNotFound));
}

double turn_during(const Sweep& sweep, std::size_t beams)
{
	constexpr double kLongestGap = 0.5, kFastest = 20;  // [s], [rad/s] beyond, odometry was reset
	const std::vector<TimedPose>& motion = sweep.motion;
	double rate = 0;  // [rad/s]
	for (std::size_t i = 1; i < motion.size(); i++)
	{
		const double step = motion[i].time - motion[i - 1].time;
		const double turn = std::abs(mrpt::math::wrapToPi(motion[i].robot.phi - motion[i - 1].robot.phi));
		if (step < kLongestGap && turn < kFastest * step) rate = std::max(rate, turn / step);
	}
	return rate * std::abs(sweep.beam_step) * std::max(0.0, static_cast<double>(beams) - 1);
}
}  // namespace d2s1r
