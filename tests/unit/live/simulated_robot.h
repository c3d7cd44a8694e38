// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A robot that drives through a drawn building, and a tracker that follows its odometry and takes seeds.
#pragma once

#include <cmath>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "live/live_localizer.h"
#include "test_floor.h"

namespace d2s1r::test
{
/// The map as ROS has it.
inline ros::OccupancyGrid map_message(const Grid& grid, const std::string& frame = "map")
{
	ros::OccupancyGrid map;
	map.header.frame = frame;
	map.resolution = grid.cell_size;
	map.width = static_cast<std::uint32_t>(grid.width);
	map.height = static_cast<std::uint32_t>(grid.height);
	map.origin = {grid.origin_x, grid.origin_y, 0};
	for (const Cell cell : grid.cells)
	{
		const int percent = cell == Cell::kFree ? 0 : cell == Cell::kOccupied ? 100 : -1;
		map.percent.push_back(static_cast<std::int8_t>(percent));
	}
	return map;
}

/// The pose of one frame in another as a message.
inline ros::Transform transform_of(
    live::Time time, const std::string& parent, const std::string& child, const mrpt::poses::CPose3D& pose)
{
	return {{time, parent}, child, pose};
}

/// A robot with a laser, wheels and a clock.
struct SimulatedRobot
{
	Grid world;  //!< with walls that have a surface
	mrpt::poses::CPose2D pose;
	mrpt::poses::CPose2D odometry;
	live::Time time = 1'700'000'000 * live::kSecond;
	mrpt::poses::CPose3D laser_on_robot{0.2, 0.05, 0.3, 0.1, 0, 0};
	int beams = 180;               //!< [-] over 360 deg
	double range_noise = 0.01;     //!< [m]
	double odometry_error = 0.02;  //!< [-] of each motion
	std::mt19937 random{1};

	/// Moves ahead and turns, as the wheels measure it.
	void move(double ahead, double turn)
	{
		std::normal_distribution<double> error(1, odometry_error);
		pose = pose + mrpt::poses::CPose2D(ahead, 0, turn);
		odometry = odometry + mrpt::poses::CPose2D(ahead * error(random), 0, turn * error(random));
	}

	/// What a beam measures of a robot that is there.
	float range(int beam, const mrpt::poses::CPose2D& robot)
	{
		std::normal_distribution<double> noise(0, range_noise);
		const auto sensor = mrpt::poses::CPose3D(robot) + laser_on_robot;
		const double angle = sensor.yaw() - M_PI + beam * 2 * M_PI / beams;
		const double range = cast_exactly(world, sensor.x(), sensor.y(), angle, 25);
		return static_cast<float>(range < 20 ? range + noise(random) : 25);
	}

	ros::LaserScan scan()
	{
		ros::LaserScan message;
		message.header = {time, "laser"};
		message.angle_step = static_cast<float>(2 * M_PI / beams);
		message.first_angle = static_cast<float>(-M_PI);
		message.min_range = 0.05F;
		message.max_range = 20;
		for (int i = 0; i < beams; i++) message.ranges.push_back(range(i, pose));
		return message;
	}

	/// A scan whose beams take `duration` [s] while the robot moves, which `after_step` hears of 50 times a second. It
	/// has the time of its first beam.
	template <typename AfterStep>
	ros::LaserScan sweep(double duration, double speed, double turn, const AfterStep& after_step)
	{
		ros::LaserScan message = scan();
		message.time_step = static_cast<float>(duration / (beams - 1));
		for (int i = 0; i < beams; i++)
		{
			const double passed = i * duration / (beams - 1);
			message.ranges[static_cast<std::size_t>(i)] =
			    range(i, pose + mrpt::poses::CPose2D(speed * passed, 0, turn * passed));
		}
		const int steps = static_cast<int>(std::lround(50 * duration));
		for (int i = 0; i < steps; i++)
		{
			time += live::kSecond / 50;
			move(speed / 50, turn / 50);
			after_step();
		}
		return message;
	}

	std::vector<ros::Transform> odometry_transform() const
	{
		return {transform_of(time, "odom", "base_link", mrpt::poses::CPose3D(odometry))};
	}

	std::vector<ros::Transform> laser_transform() const
	{
		return {transform_of(time, "base_link", "laser", laser_on_robot)};
	}
};

/// A tracker that knows no map: it follows odometry and takes what it is told.
struct SimpleTracker
{
	std::optional<mrpt::poses::CPose2D> map_to_odometry;
	int seeds = 0;

	void take(const live::Seed& seed, const mrpt::poses::CPose2D& odometry_then)
	{
		map_to_odometry = seed.pose + (-odometry_then);
		seeds++;
	}

	std::optional<mrpt::poses::CPose2D> pose(const mrpt::poses::CPose2D& odometry) const
	{
		if (!map_to_odometry) return std::nullopt;
		return *map_to_odometry + odometry;
	}
};

inline double distance_between(const mrpt::poses::CPose2D& a, const mrpt::poses::CPose2D& b)
{
	return a.distanceTo(b);
}
}  // namespace d2s1r::test
