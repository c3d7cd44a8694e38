// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>

#include <string>
#include <vector>

namespace d2s1r::app
{
/// Returns what makes it doubtful that scans will be found in the map, a line each.
/// \param file that the map was loaded from
std::vector<std::string> doubts_about_map(const std::string& file, const Localizer& map);
}  // namespace d2s1r::app
