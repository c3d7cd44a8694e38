// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/number_text.h>
#include <d2s1r/parameters.h>
#include <d2s1r/prior.h>
#include <ros/monitor.h>
#include <ros/overrides.h>

#include <string>
#include <vector>

// Each of these parses the value of an option.
// \throws std::invalid_argument "'TEXT' is not ..., and what to write instead", which does not name the option
namespace d2s1r::app
{
/// "X0,Y0,X1,Y1" [m]
Prior parse_region(const std::string& text);

/// "N,METRES"
WatchSettings parse_watch(const std::string& text);

/// "A:B" [m]
ros::HeightBand parse_height_band(const std::string& text);

/// Returns the parameters with settings "SECTION.KEY=VALUE", which win over their file.
/// \throws UserError (kWrongUse) that names --set
Parameters with_set_options(const Parameters& parameters, const std::vector<std::string>& settings);

/// Enters the overrides of a calibration file, `name: value` line by line, but for those that are given already.
/// \throws UserError if it cannot be read (kBadInput) or understood (kWrongUse)
void read_calibration(const std::string& file, ros::Overrides& overrides);
}  // namespace d2s1r::app
