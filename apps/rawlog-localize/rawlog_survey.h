// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace d2s1r::app
{
/// A laser of a rawlog.
struct Sensor
{
	std::string label;
	std::size_t scans = 0;
};

/// What a rawlog holds, known after reading it once.
struct RawlogSurvey
{
	std::vector<Sensor> sensors;  //!< in order of appearance
	bool has_odometry = false;
	std::string damage;  //!< see RawlogReader::damage()
};

RawlogSurvey survey_rawlog(const std::string& file);

/// The laser of that label, else the one with most scans (the first of equals).
/// \throws UserError if there is none: kBadInput without any scan, kWrongUse if only the label is wrong
Sensor choose_sensor(const RawlogSurvey& survey, const std::optional<std::string>& label, const std::string& file);
}  // namespace d2s1r::app
