// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPoint2D.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "cli/command_line.h"

// Each of these parses the value of an option.
// \throws std::invalid_argument "'TEXT' is not ..., and what to write instead", which does not name the option
namespace d2s1r::app
{
std::uint64_t parse_whole_number(
    const std::string& text, std::uint64_t least, std::uint64_t greatest = std::numeric_limits<std::uint64_t>::max());

/// "A:B:STEP"
FrameRange parse_frames(const std::string& text);

/// Returns no value for one scan, which has no others to be used with.
std::optional<int> parse_window(const std::string& text);

/// "X0,Y0,X1,Y1" [m]
Prior parse_region(const std::string& text);

/// [ms]
double parse_time_budget(const std::string& text);

MotionSource parse_motion(const std::string& text);

/// "N,METRES"
live::WatchSettings parse_watch(const std::string& text);

/// [m/pixel]
double parse_resolution(const std::string& text);

/// "X,Y" [m]
mrpt::math::TPoint2D parse_point(const std::string& text);

/// "X,Y,Z,YAW,PITCH,ROLL" [m, deg]
mrpt::poses::CPose3D parse_sensor_pose(const std::string& text);

/// [m]
float parse_max_range(const std::string& text);

double parse_range_factor(const std::string& text);

/// "A:B" [m]
ros::HeightBand parse_height_band(const std::string& text);

/// "S" or "S,FIRST" [s]
logs::BeamAngles parse_beam_angles(const std::string& text);

/// Returns the option that gives these angles.
std::string beam_angles_option(const logs::BeamAngles& angles);

logs::SweepTime parse_sweep_time(const std::string& text);
}  // namespace d2s1r::app
