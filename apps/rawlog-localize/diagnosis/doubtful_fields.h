// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/trials.h"

namespace d2s1r::app
{
/// Returns the mistakes that fields of the scans show: another way to mount or to read the laser than the log says, if
/// it says one, another field of view, a range of the laser that is none.
/// \param given angles and ranges, which stay as they are
std::vector<Mistake> mistakes_of_fields(
    const Samples& samples, const std::optional<logs::OtherAngles>& other_angles, const logs::Overrides& given);

/// Returns the line about scans that cannot be used, if most are: the field that is wrong, and what to do.
/// \param trial of the scans as they are
std::vector<std::string> advice_on_invalid(const Trial& trial, const Tester& tester);
}  // namespace d2s1r::app
