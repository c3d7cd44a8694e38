// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>
#include <ros/overrides.h>

#include <map>
#include <string>
#include <vector>

#include "frames/logged_scan.h"
#include "input/inputs.h"

namespace d2s1r::app
{
struct Samples
{
	std::vector<LoggedScan> chosen;                         //!< of the laser that is localized
	std::map<std::string, std::vector<LoggedScan>> others;  //!< by the label of another laser
};

/// Reads 20 of the selected scans, evenly spread over them, and as many of each other laser.
Samples read_samples(logs::LogReader& reader, const logs::LogSurvey& survey, const FrameSelection& selection);

struct Mistake
{
	std::string what;             //!< goes on after "17 of 20 scans fit, instead of 2, if "
	ros::Overrides correction{};  //!< of the scans as they are read
	std::string to_do{};          //!< what corrects it beside or in place of the options
	bool toggles_zeros = false;   //!< whether scan.zero_is_no_return is the other way round
	std::string other_laser{};    //!< label of the laser whose scans are tried; empty: that of the run
	/// Whether the map can show it: some beams are read in another way without the mistake, and the walls around the
	/// places where scans are found confirm or contradict that.
	bool changes_beams = false;
};

/// Returns what the mistake is, and the options that correct it.
/// \param given overrides of the command line
std::string advice_against(const Mistake& mistake, const ros::Overrides& given);

/// Returns the correction of ranges that have to be multiplied by `factor`. \param max_range [m] of the laser as it is
ros::Overrides scaled_by(double factor, float max_range);

/// Returns the mistakes that may have been made with samples, but for the resolution and those of their fields: the
/// unit of ranges, max_range, zeros, the choice of the laser. \param parameters that the scans are read with
std::vector<Mistake> usual_mistakes(const Samples& samples, const ScanParameters& parameters);

/// Returns a scan as it is without a mistake, its beams moved to its time.
Scan corrected(const LoggedScan& scan, const Mistake& mistake, ScanParameters parameters);

/// Returns the share [0, 1] of the beams that are read in another way without a mistake which the map agrees with, seen
/// from where their scans were found. It is 0 if fewer than three scans were found.
/// \param answers of the samples without the mistake, in their order
double share_that_map_confirms(
    const Mistake& mistake, const std::vector<LoggedScan>& samples, const std::vector<Localization>& answers,
    const Localizer& localizer);
}  // namespace d2s1r::app
