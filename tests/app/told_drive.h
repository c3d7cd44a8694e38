// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Drives through make_floor() whose messages say what is wrong.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "calibration/simulated_drive.h"
#include "logs/made_logs.h"

namespace d2s1r::test
{
inline constexpr double kDriveStart = 1'700'000'000;  //!< [s]

/// A drive as it was, and what its messages say of it.
struct ToldDrive
{
	/// A robot that turns by at most `rate` [rad/s], with a scan a second of a laser 0.2 m before its middle.
	explicit ToldDrive(double rate = 1, int scans = 40)
	{
		drive.turn = rate;
		drive.seconds = scans + 0.4;
		drive.truth.laser = {0.2, 0, 0};
		drive.beams = 240;
	}

	DriveSettings drive;
	double told_duration = 0;  //!< [s] of the sweep, by time_increment
	double told_step = 1;      //!< [-] angle_increment over the true one
	MadeTransform mount = {"base_link", "laser", 0.2, 0, 0.2, 'z', 0};
	std::optional<MadeTransform> moving_mount{};  //!< that /tf says, beside /tf_static
	/// Of a second laser, in truth, and the yaw [rad] that messages say.
	std::optional<mrpt::math::TPose2D> other_laser{};
	double told_other_yaw = 0;
	bool are_scans_mirrored = false;  //!< as of a laser upside down
	bool has_odometry = true, is_odometry_on_tf = false;
};

/// Returns the messages of a drive.
inline std::vector<MadeMessage> messages_of(const ToldDrive& told)
{
	constexpr Wire kWire = Wire::kCdr;
	const auto at = [](double seconds) { return std::llround(1e9 * kDriveStart) + std::llround(1e9 * seconds); };
	std::vector<MadeTransform> mounts = {told.mount};
	if (told.other_laser)
		mounts.push_back(
		    {"base_link", "other", told.other_laser->x, told.other_laser->y, 0.2, 'z', told.told_other_yaw});
	std::vector<MadeMessage> messages = {made_transforms(kWire, at(0), mounts)};
	DriveSettings settings = told.drive;
	settings.field_of_view *= told.told_step;  // of the messages
	settings.truth.angle_scale /= told.told_step;
	const auto add_scans = [&](const SimulatedDrive& drive, const std::string& frame, const std::string& topic)
	{
		for (const calibration::FoundScan& scan : drive.scans)
		{
			MadeScan made;
			made.time = at(scan.time);
			made.frame = frame;
			made.first_angle = scan.first_angle;
			made.angle_step = static_cast<float>(settings.field_of_view / settings.beams);
			made.time_step = static_cast<float>(told.told_duration / (settings.beams - 1));
			made.max_range = 20;
			made.ranges.assign(static_cast<std::size_t>(settings.beams), HUGE_VALF);
			for (const auto& beam : scan.returns)
				made.ranges[static_cast<std::size_t>(
				    std::lround(beam.share * static_cast<float>(settings.beams - 1)))] = beam.range;
			const auto span = made.angle_step * static_cast<float>(settings.beams - 1);
			if (told.told_step != 1) made.last_angle = made.first_angle + span * static_cast<float>(1 / told.told_step);
			if (told.are_scans_mirrored)
			{
				std::reverse(made.ranges.begin(), made.ranges.end());
				made.first_angle = -made.first_angle - span;
			}
			messages.push_back(made_scan(kWire, made, topic));
		}
	};
	const SimulatedDrive drive = simulate_drive(make_floor(), settings);
	if (told.other_laser)
	{
		const mrpt::math::TPose2D laser = std::exchange(settings.truth.laser, *told.other_laser);
		add_scans(simulate_drive(make_floor(), settings), "other", "/other_scan");
		settings.truth.laser = laser;
	}
	add_scans(drive, "laser", "/scan");
	for (std::size_t i = 0; told.has_odometry && i < drive.odometry.size(); i++)
	{
		const auto& [time, pose] = drive.odometry[i];
		messages.push_back(
		    told.is_odometry_on_tf
		        ? made_transforms(kWire, at(time), {{"odom", "base_link", pose.x, pose.y, 0, 'z', pose.phi}}, "/tf")
		        : made_odometry(kWire, at(time), pose.x, pose.y, pose.phi));
		messages.back().time = at(drive.robot[i].time);
	}
	for (double time = 0; told.moving_mount && time < told.drive.seconds; time += 0.1)
		messages.push_back(made_transforms(kWire, at(time), {*told.moving_mount}, "/tf"));
	std::stable_sort(
	    messages.begin(), messages.end(), [](const MadeMessage& a, const MadeMessage& b) { return a.time < b.time; });
	return messages;
}

/// Returns the robot's true poses at the stamps of the scans.
inline std::vector<mrpt::math::TPose2D> robots_of(const ToldDrive& told)
{
	const SimulatedDrive drive = simulate_drive(make_floor(), told.drive);
	std::vector<mrpt::math::TPose2D> robots;
	for (const calibration::FoundScan& scan : drive.scans)
		robots.push_back(drive.robot[static_cast<std::size_t>(std::lround(scan.time / drive.robot[1].time))].robot);
	return robots;
}
}  // namespace d2s1r::test
