// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What the programs of this project need of the library, and others do not. It is not installed.
#pragma once

#include <d2s1r/parameters.h>
#include <mrpt/maps/COccupancyGridMap2D.h>

#include <cstdint>
#include <string>
#include <vector>

namespace d2s1r
{
/// Returns about how much memory [byte] it takes to build a Localizer of `map`, beside the map itself; one that is
/// built has less. It looks only at the cells and is done long before an index is. Thread-safe.
/// \throws std::invalid_argument if the map has no cell that is known
std::uint64_t memory_to_build(const mrpt::maps::COccupancyGridMap2D& map, const Parameters& parameters = {});

/// Checks that Localizer::save() could write this file, so that a program can tell before it builds an index.
/// \throws std::runtime_error as save() would before it has written anything
void check_savable(const std::string& file);

/// Returns the share [0, 1] of the image of a yaml map that has the shade of unknown cells, 205, but that the
/// thresholds of the file make free; 0 for other maps. map_server writes that shade, and `free_thresh: 0.25`, which is
/// often seen beside it, makes such cells free.
/// \throws std::runtime_error saying what is wrong, without the name of the yaml file
double unknown_made_free(const std::string& file);

/// Returns the name that a map gets by its file: without folder, extension and that of a compressed file.
std::string map_name_of(const std::string& file);

/// Returns the SIMD targets that this machine runs and the library was compiled for, the one in use first: "avx3"
/// (AVX-512), "avx2", "neon" or "portable". Results are the same with each of them, bit for bit.
std::vector<std::string> simd_targets();

/// Makes the library use one of simd_targets() from here on. Call it before any other thread runs.
/// 	hrows std::invalid_argument if the machine or the library lacks it
void use_simd_target(const std::string& name);
}  // namespace d2s1r
