// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/map_io.h>

#include <optional>
#include <string>

#include "cli/console.h"

namespace d2s1r::app
{
/// Loads a map file. Formats that MRPT's own readers read are loaded in a process of their own, since these readers
/// trust what they read.
/// \param image only if the map is an image
/// \param activity shown while it takes long
/// \throws std::exception that need not name the file, UserError (kInterrupted)
mrpt::maps::COccupancyGridMap2D::ConstPtr load_grid(
    const std::string& file, const std::optional<ImageGeometry>& image, const GridParameters& parameters,
    Activity& activity);
}  // namespace d2s1r::app
