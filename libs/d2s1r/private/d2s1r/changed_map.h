// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/map_io.h>

#include <memory>
#include <optional>
#include <string>

namespace d2s1r
{
/// Says in which way a map file is read differently from what it says.
enum class MapChange
{
	kNone,
	kNegated,  //!< black is free and white occupied, or the other way round
	kScaled,   //!< mode: scale, of a yaml map
	kRaw       //!< mode: raw, of a yaml map
};

/// Loads a yaml map or an image in another way than it is meant to be, to find out what is wrong with it.
/// \throws std::runtime_error naming the file and what is wrong with it
std::shared_ptr<const OccupancyMap> load_changed_map(
    const std::string& file, MapChange change, const GridParameters& parameters,
    const std::optional<ImageGeometry>& image);
}  // namespace d2s1r
