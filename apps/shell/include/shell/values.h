// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/parameters.h>
#include <d2s1r/prior.h>
#include <ros/monitor.h>
#include <ros/overrides.h>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

// Each of these parses the value of an option.
// \throws std::invalid_argument "'TEXT' is not ..., and what to write instead", which does not name the option
namespace d2s1r::app
{
/// Throws this error. \param what follows the text
[[noreturn]] void refuse_value(const std::string& text, const std::string& what);

std::uint64_t parse_whole_number(
    const std::string& text, std::uint64_t least, std::uint64_t greatest = std::numeric_limits<std::uint64_t>::max());

/// \param otherwise what is wrong with other texts
double parse_finite_number(const std::string& text, const std::string& otherwise = "is not a finite number");

/// Parses finite numbers with commas between them.
std::vector<double> parse_number_list(const std::string& text);

/// "X0,Y0,X1,Y1" [m]
Prior parse_region(const std::string& text);

/// "N,METRES"
WatchSettings parse_watch(const std::string& text);

/// "A:B" [m]
ros::HeightBand parse_height_band(const std::string& text);

/// Returns the parameters with settings "SECTION.KEY=VALUE", which win over their file.
/// \throws UserError (kWrongUse) that names --set
Parameters with_set_options(const Parameters& parameters, const std::vector<std::string>& settings);

/// "S" or "S,FIRST" [s]
ros::SweepTime parse_sweep_time(const std::string& text);

/// "X,Y,Z,YAW,PITCH,ROLL" [m, deg]
mrpt::poses::CPose3D parse_sensor_pose(const std::string& text);

/// [m]
float parse_range(const std::string& text);

double parse_range_factor(const std::string& text);

/// "FIRST,LAST" [deg]
ros::BeamAngles parse_beam_angles(const std::string& text);

/// Enters the overrides of a calibration file, `name: value` line by line, but for those that are given already.
/// \throws UserError if it cannot be read (kBadInput) or understood (kWrongUse)
void read_calibration(const std::string& file, ros::Overrides& overrides);
}  // namespace d2s1r::app
