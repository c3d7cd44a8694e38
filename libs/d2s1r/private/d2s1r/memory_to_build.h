// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/occupancy_map.h>
#include <d2s1r/parameters.h>

#include <cstdint>

namespace d2s1r
{
/// Returns about how much memory [byte] it takes to build a Localizer of `map`, beside the map itself; one that is
/// built has less. It looks only at the cells and is done long before an index is. Thread-safe.
/// \throws std::invalid_argument if the map has no cell that is known
std::uint64_t memory_to_build(const OccupancyMap& map, const Parameters& parameters = {});
}  // namespace d2s1r
