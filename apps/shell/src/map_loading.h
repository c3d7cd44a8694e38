// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/map_io.h>

#include <optional>
#include <string>

namespace d2s1r::app
{
/// Loads a map file in a process of its own with limits, since MRPT's readers and decoders of images trust what they
/// read. \param image only if the map is an image
/// \throws std::exception that need not name the file
std::shared_ptr<const OccupancyMap> load_map_apart(
    const std::string& file, const std::optional<ImageGeometry>& image, const GridParameters& parameters);
}  // namespace d2s1r::app
