// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/trials.h"

namespace d2s1r::app
{
/// Returns the pose of the laser on the robot by the log.
mrpt::poses::CPose3D laser_on_robot(const Sample& sample);

/// Returns the text of --sensor-pose [m, deg] for a laser that is turned by (yaw, roll) [deg] against `pose`.
std::string turned_pose(const mrpt::poses::CPose3D& pose, double yaw, double roll);

/// Returns the mistakes that fields of the scans show: angles that contradict each other or are none, another field of
/// view than the log says, a range of the laser that is none, a laser whose frame is an optical one or has a tilt that
/// is none.
std::vector<Mistake> mistakes_of_fields(const Samples& samples, const std::optional<logs::OtherAngles>& other_angles);

/// Returns the line about scans that cannot be used, if most are: the field that is wrong, and what to do.
/// \param trial of the scans as they are
std::vector<std::string> advice_on_invalid(const Trial& trial, const Tester& tester);

/// Returns which of two ways to read the angles puts the scans nearer to the walls, if that can be told.
/// \param as_it_is trial of the scans as they are
std::vector<std::string> advice_by_angles(
    const Tester& tester, const Trial& as_it_is, const logs::OtherAngles& other_angles);

/// Returns the line about ranges that are all too long or too short, by up to 10 %, if localized scans show it.
/// \param as_it_is trial of the scans as they are
/// \param range_factor [-] that the ranges have been multiplied by
/// \param of_map says how to set the map right in place of ranges that would have to be multiplied by a factor [-]
std::vector<std::string> advice_by_scale(
    const Tester& tester, const Trial& as_it_is, double range_factor, const std::function<std::string(double)>& of_map);
}  // namespace d2s1r::app
