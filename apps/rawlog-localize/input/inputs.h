// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "cli/command_line.h"

namespace d2s1r::app
{
/// Checks that the method can do what the command line asks for. \throws UserError (kWrongUse) if it cannot
void check_method(Method method, const CommandLine& command);

/// Labels the poses in localized.rawlog as those of a sensor.
inline constexpr const char* kPoseLabel = "D2S1R";

/// Labels the pseudo-odometry in localized.rawlog as that of a sensor.
inline constexpr const char* kPseudoOdometryLabel = "D2S1R_ODO";

/// Returns what is said of a log's damage: with the option that loads the module of a missing class, if it is that.
std::string describe_damage(const std::string& damage, const std::string& missing_class);

/// Recognizes the log and reads it once, or begins to read it if it is still being written.
/// \param prepare called before the first scan of a log that is still being written is waited for
/// \throws logs::LogError, UserError (kInterrupted), what `prepare` throws
logs::Log open_log(const LogRequest& request, const std::function<void()>& prepare);

/// Returns the laser that is asked for, else the one with most scans (the first of equals): of those with at least half
/// as many, one whose pose on the robot is known goes before others.
/// \throws UserError if there is none: kBadInput without any scan, kWrongUse if only the label is wrong
logs::Sensor choose_sensor(const logs::LogSurvey& survey, const LogRequest& request);

/// Refuses to merge lasers of which one has no known pose on the robot. \throws UserError (kWrongUse)
void check_merge(const logs::LogSurvey& survey, const logs::Sensor& sensor);

/// Returns what to tell the user about a log before its scans are localized, a line each.
std::vector<std::string> describe_log(
    const logs::LogSurvey& survey, const logs::Sensor& sensor, const LogRequest& request, MotionSource motion);

struct FrameSelection
{
	std::string label;      //!< of the sensor
	std::size_t first = 0;  //!< [-] scan frames first, first + step, first + 2 step, ... below past
	std::size_t past = 0;
	std::size_t step = 1;

	bool contains(std::size_t frame) const { return frame >= first && frame < past && (frame - first) % step == 0; }
	std::size_t size() const { return (past - first + step - 1) / step; }
};

/// Returns the frames that are asked for and that the log has. \throws UserError (kWrongUse) if there is none
FrameSelection select_frames(const FrameRange& frames, const logs::Sensor& sensor);
}  // namespace d2s1r::app
