// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What the drive of a log shows of how its laser must be read, before the scans are localized.
#pragma once

#include <d2s1r/atlas.h>
#include <d2s1r/calibration.h>
#include <logs/log.h>
#include <ros/drive_calibration.h>

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "cli/command_line.h"

namespace d2s1r::app
{
/// How a laser has to be read by what a drive shows.
struct DriveCalibration
{
	calibration::Calibration found;
	logs::Overrides overrides;  //!< the given ones, and what the drive contradicts of the messages
	std::string file;  //!< the overrides as lines `name: value` of calibration.yaml; empty: nothing is contradicted
	ros::Doubt doubt;  //!< of poses, where the drive does not confirm how the laser is read
	std::string line;  //!< says what was found, how sure it is, and which options say the same; empty as `file`
	/// Of scans that were localized as the messages say, by their numbers in the log, if nothing is changed.
	std::map<std::size_t, Localization> answers{};
};

/// Calibrates the laser by some tens of scans, spread over the log, wherever the robot moves. What the command line
/// gives stays as it is given. It hears interrupts, and then finds nothing.
/// \param is_brief whether scans are not searched one by one if the messages lead from each to the next
DriveCalibration calibrate_by_drive(
    const logs::Log& log, const logs::Sensor& sensor, const logs::Overrides& overrides, const SearchRequest& search,
    const Atlas& atlas, bool is_brief);

/// Returns a picture (SVG) of how far returns end from the walls, and motions are from the odometry's, as told and as
/// shown; empty if the drive shows nothing.
std::string picture_of(const calibration::Calibration& found);

/// Returns the table of what a drive shows: unknown, messages, drive, standard deviation, verdict.
std::string table_of(const DriveCalibration& calibration);
}  // namespace d2s1r::app
