// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>

#include <string>

namespace d2s1r::app
{
/// As a serialized CSignatureMap2D. \throws UserError (kBadOutput)
void save_map(const mrpt::maps::COccupancyGridMap2D& grid, const Parameters& parameters, const std::string& path);
}  // namespace d2s1r::app
