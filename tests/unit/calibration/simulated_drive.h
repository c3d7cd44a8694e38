// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A robot with a spinning laser that drives through a building, for what a drive shows of the laser.
#pragma once

#include <d2s1r/calibration.h>

#include <cmath>
#include <random>
#include <vector>

#include "ranges/ray_caster.h"
#include "test_floor.h"

namespace d2s1r::test
{
/// How a robot drives, and how its laser is in truth.
struct DriveSettings
{
	calibration::Reading truth;
	double seconds = 60;
	double field_of_view = 2 * M_PI;  //!< [rad]
	int beams = 180;
	double period = 1;             //!< [s] from one scan to the next
	double odometry_error = 0.05;  //!< [-] standard deviation of the factor of ways and turns, new with each command
	double range_noise = 0.01;     //!< [m]
	double speed = 0.6, turn = 1;  //!< [m/s], [rad/s] greatest of a command
	unsigned seed = 1;
};

/// What a drive recorded.
struct SimulatedDrive
{
	std::vector<TimedPose> robot, odometry;     //!< in the map, and in the odometry's frame, 50 times a second
	std::vector<calibration::FoundScan> scans;  //!< without poses in the map
};

/// Drives through free space and records.
inline SimulatedDrive simulate_drive(const Grid& map, const DriveSettings& settings)
{
	constexpr double kStep = 0.02, kClearance = 0.35, kReach = 20;  // [s], [m], [m]
	using mrpt::math::TPose2D;
	std::mt19937 random(settings.seed);
	std::uniform_real_distribution<double> unit(0, 1);
	std::normal_distribution<double> normal;
	const auto is_open = [&](double x, double y)
	{
		const int reach = static_cast<int>(kClearance / map.cell_size);
		const int column = static_cast<int>(std::floor((x - map.origin_x) / map.cell_size)),
		          row = static_cast<int>(std::floor((y - map.origin_y) / map.cell_size));
		for (int v = row - reach; v <= row + reach; v++)
			for (int u = column - reach; u <= column + reach; u++)
				if (!map.contains(u, v) || map.at(u, v) != Cell::kFree) return false;
		return true;
	};
	SimulatedDrive drive;
	TPose2D robot = random_poses(map, 1, 0.6, settings.seed).front(), odometry;
	double speed = 0, turn = 0, wanted_speed = 0, wanted_turn = 0, until = 0, way_factor = 1, turn_factor = 1;
	for (double time = 0; time < settings.seconds + 1; time += kStep)
	{
		drive.robot.push_back({time, robot});
		drive.odometry.push_back({time + settings.truth.odometry_clock, odometry});
		const bool is_free = is_open(robot.x + 0.3 * std::cos(robot.phi), robot.y + 0.3 * std::sin(robot.phi));
		if (time >= until)
		{
			until = time + 0.5 + 2 * unit(random);
			wanted_speed = settings.speed * std::max(0.0, 1.3 * unit(random) - 0.3);
			wanted_turn = settings.turn * (2 * unit(random) - 1);
			way_factor = 1 + settings.odometry_error * normal(random);
			turn_factor = 1 + settings.odometry_error * normal(random);
		}
		if (!is_free) speed = wanted_speed = 0, wanted_turn = wanted_turn < 0 ? -settings.turn : settings.turn;
		const auto approach = [](double value, double wanted, double most)
		{ return value + std::clamp(wanted - value, -most, most); };
		speed = approach(speed, wanted_speed, 1.0 * kStep), turn = approach(turn, wanted_turn, 3.0 * kStep);
		const double side = settings.truth.is_odometry_mirrored ? -1 : 1;
		robot = robot + TPose2D(speed * kStep, 0, turn * kStep);
		odometry = odometry + TPose2D(
		                          way_factor / settings.truth.way_scale * speed * kStep, 0,
		                          side * turn_factor / settings.truth.turn_scale * turn * kStep);
	}
	const auto robot_at = [&](double time)
	{
		const double at = std::clamp(time / kStep, 0.0, static_cast<double>(drive.robot.size()) - 1.001);
		const auto i = static_cast<std::size_t>(at);
		const TPose2D &a = drive.robot[i].robot, &b = drive.robot[i + 1].robot;
		const double u = at - static_cast<double>(i);
		return TPose2D(a.x + u * (b.x - a.x), a.y + u * (b.y - a.y), a.phi + u * mrpt::math::wrapToPi(b.phi - a.phi));
	};
	const RayCaster world(world_of(map), kReach);
	for (double time = 0.5; time < settings.seconds; time += settings.period)
	{
		calibration::FoundScan scan;
		scan.time = time;
		scan.first_angle = static_cast<float>(-settings.field_of_view / 2);
		for (int i = 0; i < settings.beams; i++)
		{
			const double share = static_cast<double>(i) / (settings.beams - 1);
			const double step = settings.field_of_view / settings.beams * i;
			const TPose2D laser =
			    robot_at(time + settings.truth.first_beam() + share * settings.truth.duration) + settings.truth.laser;
			const double angle = static_cast<double>(scan.first_angle) + settings.truth.angle_scale * step;
			const double range = static_cast<double>(world.cast(laser.x, laser.y, laser.phi + angle));
			if (range >= kReach) continue;
			scan.returns.push_back(
			    {static_cast<float>(static_cast<double>(scan.first_angle) + step),
			     static_cast<float>((range + settings.range_noise * normal(random)) / settings.truth.range_factor),
			     static_cast<float>(share)});
		}
		// As a localizer that takes the beams as taken at once finds it.
		scan.laser = robot_at(time + settings.truth.middle()) + settings.truth.laser;
		drive.scans.push_back(scan);
	}
	return drive;
}
}  // namespace d2s1r::test
