// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPoint2D.h>
#include <shell/values.h>

#include <optional>
#include <string>

#include "cli/command_line.h"

// Each of these parses the value of an option, as those of shell/values.h do.
namespace d2s1r::app
{
/// "A:B:STEP"
FrameRange parse_frames(const std::string& text);

/// Returns no value for one scan, which has no others to be used with.
std::optional<int> parse_window(const std::string& text);

/// [ms]
double parse_time_budget(const std::string& text);

MotionSource parse_motion(const std::string& text);

/// [m/pixel]
double parse_resolution(const std::string& text);

/// "X,Y" [m]
mrpt::math::TPoint2D parse_point(const std::string& text);

/// Returns what is given as options, "--sweep-time 0.1 --mirrored-odometry".
std::string options_of(const ros::Overrides& overrides);

/// Returns the option that gives these angles.
std::string beam_angles_option(const ros::BeamAngles& angles);
}  // namespace d2s1r::app
