// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <ros/wall_gain.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "frames/logged_scan.h"
#include "input/inputs.h"

namespace d2s1r::app
{
/// A scan of the log, and one that was taken after the robot had moved on.
struct Sample
{
	LoggedScan scan;
	LoggedScan later;             //!< without an observation if the odometry shows no motion
	mrpt::poses::CPose2D motion;  //!< from scan to later by the odometry
	double middle_angle;          //!< [rad] see RawlogObject
};

/// Scans of a log that are tried.
struct Samples
{
	std::vector<Sample> chosen;                             //!< of the laser that is localized
	std::map<std::string, std::vector<LoggedScan>> others;  //!< by the label of another laser
	double period = 0;  //!< [s] from one scan of the laser to the next, in the median; 0: not known
};

/// Reads 20 of the selected scans, evenly spread over them, and as many of each other laser.
Samples read_samples(logs::LogReader& reader, const logs::LogSurvey& survey, const FrameSelection& selection);

/// What a scan would be without a mistake.
using Correction = std::function<void(mrpt::obs::CObservation2DRangeScan&)>;

/// A mistake that may have been made.
struct Mistake
{
	std::string advice;  //!< goes on after "17 of 20 scans fit, instead of 2, if "
	Correction correct = [](mrpt::obs::CObservation2DRangeScan&) {};
	bool toggles_zeros = false;  //!< whether scan.zero_is_no_return is the other way round
	std::string other_laser{};   //!< label of the laser whose scans are tried; empty: that of the run
	bool mirrors = false;        //!< whether scans or image are mirrored: the odometry tells which of them
	/// What `correct` sets though the log does not know it.
	logs::ScanDoubt::Field gives = logs::ScanDoubt::Field::kNone;
	/// Whether the map can show it: some beams are read in another way without the mistake, and the walls around the
	/// places where scans are found confirm or contradict that.
	bool changes_beams = false;
};

/// Returns the correction of ranges that have to be multiplied by `factor`.
Correction scaled_by(double factor);

/// Returns the mistakes that may have been made with samples, but for the resolution: a mirror, the unit of ranges,
/// maxRange, zeros, the choice of the laser.
/// \param parameters that the scans are read with
/// \param range_factor [-] that the ranges have been multiplied by
std::vector<Mistake> usual_mistakes(const Samples& samples, const ScanParameters& parameters, double range_factor = 1);

/// Returns a scan as it is without a mistake, its beams moved to its time.
Scan corrected(const LoggedScan& scan, const Mistake& mistake, ScanParameters parameters);

/// Returns the share [0, 1] of the beams that are read in another way without a mistake which the map agrees with, seen
/// from where their scans were found. It is 0 if fewer than three scans were found.
/// \param answers of the samples without the mistake, in their order
double share_that_map_confirms(
    const Mistake& mistake, const std::vector<Sample>& samples, const std::vector<Localization>& answers,
    const Localizer& localizer);
}  // namespace d2s1r::app
