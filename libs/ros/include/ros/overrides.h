// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/range_scan.h>
#include <mrpt/poses/CPose2D.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ros/observation.h"

namespace d2s1r::ros
{
/// Says where the beams of a laser's scans look: [rad] in the frame of the laser, counter-clockwise, as they are
/// recorded. The last one is below the first if the laser turns clockwise.
struct BeamAngles
{
	double first = 0;
	double last = 0;
};

/// Says what is known better about a laser and the odometry of its robot than the messages tell it: a person gives it,
/// or a drive shows it.
struct Overrides
{
	std::optional<mrpt::poses::CPose3D> sensor_pose;  //!< laser on the robot
	std::optional<float> max_range;                   //!< [m]
	std::optional<double> min_range;                  //!< [m] readings below that are no data
	std::optional<double> range_factor;               //!< [-] of all recorded ranges
	std::optional<SweepTime> sweep;                   //!< of all scans
	std::optional<BeamAngles> beam_angles;            //!< of all scans
	bool ignores_flags = false;                       //!< whether readings that are flagged invalid count
	bool is_odometry_mirrored = false;                //!< whether its left is right
	double odometry_clock = 0;                        //!< [s] of its clock minus that of the scans
};

/// Lets a scan be as overrides say. Ranges that were above the laser's range count if they are below the new one.
/// \param middle_angle [rad] of the middle of its beams in the frame of the laser
void apply(const Overrides& overrides, double middle_angle, RangeScan& scan);

/// Returns a pose of the odometry, or a motion, as overrides say.
mrpt::poses::CPose2D odometry_as(const Overrides& overrides, const mrpt::poses::CPose2D& told);

/// Returns the names of what is given, and the values, as the lines of a calibration file have them. An empty value
/// says that the name alone is given.
std::vector<std::pair<std::string, std::string>> entries_of(const Overrides& overrides);

/// Returns what is given as lines of a calibration file, "sweep-time: 0.1".
std::vector<std::string> lines_of(const Overrides& overrides);

/// Gives a value by its name, as entries_of() has it; the value of a name that is given alone is "true". Returns
/// whether there is such a name.
/// \throws std::invalid_argument "'TEXT' is not ..., and what to write instead", which does not repeat the name
bool enter(const std::string& name, const std::string& value, Overrides& overrides);
}  // namespace d2s1r::ros
