// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>

#include <string>
#include <vector>

#include "cli/command_line.h"
#include "evaluation/ground_truth.h"
#include "input/inputs.h"

namespace d2s1r::app
{
struct Diagnosis
{
	std::size_t tried = 0;            //!< [-] scans, evenly spread over the selected ones
	std::size_t fit = 0;              //!< [-] of these are localized as the command line and the log have them
	std::vector<std::string> advice;  //!< a line each: how many fit if something is wrong, and the option that sets it
};

/// Tries on 20 of the selected scans what is usually wrong if scans do not fit to a map: the resolution, an image that
/// is flipped or inverted, scans that are mirrored, the unit of ranges, max_range, zeros, angles, the laser's frame, a
/// region, the choice of the laser; by the ground truth also an origin that is wrong. A mistake is named only if far
/// more scans fit without it. What a drive shows is not looked for: see calibrate_by_drive(). Of a map that may be read
/// wrongly it builds another index, if there is memory for that.
/// \param localizer of the default method
/// \throws UserError (kInterrupted)
Diagnosis diagnose(
    const logs::Log& log, const FrameSelection& selection, const CommandLine& command, const Localizer& localizer,
    const GroundTruth& truth);
}  // namespace d2s1r::app
