// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/occupancy_map.h>
#include <d2s1r/parameters.h>

#include <string>

namespace d2s1r
{
/// Reads a map file of MRPT's own formats by the program that library d2s1r-mrpt brings, since the library itself does
/// not know MRPT's maps. A crash of that program is an error like others. Thread-safe.
/// \throws std::runtime_error saying what is wrong with the file, or that the program is missing, without the name of
///         the file; std::bad_alloc
OccupancyMap read_foreign_map(const std::string& file, const GridParameters& parameters);
}  // namespace d2s1r
