// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// When the beams of scans were taken, if the log does not tell or is wrong about it.
#pragma once

#include <d2s1r/localizer.h>

#include <optional>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "diagnosis/mistakes.h"

namespace d2s1r::app
{
/// When the beams of a laser were taken, and what the user should know about it.
struct SettledSweep
{
	std::optional<logs::SweepTime> sweep;  //!< to be used in place of what the log says
	std::vector<std::string> lines;
};

/// Decides by the map when the beams of a laser were taken, if the log only gives a guess (logs::Sensor), or clouds
/// that may have been moved to one time before, and the robot turns so fast that it matters. It reads the log until the
/// map tells that, whichever frames are selected, and hears interrupts. \param localizer null: no map can tell
SettledSweep settle_sweep(
    const logs::Log& log, const logs::Sensor& sensor, const logs::Overrides& overrides, const SearchRequest& search,
    const Localizer* localizer);

/// Returns the line about a sweep that the log does not tell, or tells though all beams are taken at once, if the map
/// shows that on scans of a turning robot. \param samples of the log, one or more
std::vector<std::string> advice_by_sweep(
    const logs::Log& log, const Samples& samples, const logs::Overrides& overrides, const SearchRequest& search,
    const Localizer& localizer);
}  // namespace d2s1r::app
