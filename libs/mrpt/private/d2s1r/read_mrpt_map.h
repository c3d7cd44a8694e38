// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/occupancy_map.h>
#include <d2s1r/parameters.h>

#include <memory>
#include <string>

namespace d2s1r
{
/// Reads a map file of MRPT's own formats: a serialized map that grid_of() takes, which may be packed. It may crash if
/// the file is damaged, as MRPT's readers do; load_map() reads the same files without that risk.
/// \throws std::runtime_error saying what is wrong with the file, without its name; std::bad_alloc
std::shared_ptr<const OccupancyMap> read_mrpt_map(const std::string& file, const GridParameters& parameters);
}  // namespace d2s1r
