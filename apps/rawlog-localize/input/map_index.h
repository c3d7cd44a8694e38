// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/CSignatureMap2D.h>
#include <d2s1r/atlas.h>
#include <d2s1r/map_io.h>

#include <optional>
#include <string>

#include "cli/console.h"

namespace d2s1r::app
{
/// What one map of a run is made from.
struct MapSource
{
	AtlasEntry entry;                      //!< its name is empty if there is only one map, which is no atlas
	std::string atlas = {};                //!< that lists the map, as messages name it
	std::optional<ImageGeometry> image{};  //!< only if the map is an image
	std::string index = {};                //!< file in which the index is kept; empty: none
};

/// Where the index of the map came from.
struct IndexUse
{
	bool loaded = false;    //!< whether it was loaded from the file of --index
	std::string why_built;  //!< if it was not, and --index was given: why
};

/// A map with its index.
struct IndexedMap
{
	AtlasEntry entry;
	CSignatureMap2D::ConstPtr map;
	IndexUse use;
};

/// Returns how much memory [byte] the index of a map takes about. \throws std::runtime_error if there is less
double memory_of_index(const mrpt::maps::COccupancyGridMap2D& grid, const Parameters& parameters);

/// Loads the map file and builds its index, and tells on a terminal that it does.
/// \param threads [-] for method = paper
/// \throws UserError (kBadInput; kWrongUse if the region of the only map lies outside it; kInterrupted)
CSignatureMap2D::ConstPtr build_map(
    const MapSource& source, const Parameters& parameters, int threads, Console& console);

/// Loads the index from its file, with the map in it. If there is none, or it is not the index of this map and these
/// parameters, it does what build_map() does, and saves the index in that file.
/// \throws UserError (as build_map(); kBadOutput if the index cannot be saved)
IndexedMap load_or_build_map(const MapSource& source, const Parameters& parameters, int threads, Console& console);
}  // namespace d2s1r::app
