// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cli/console.h"
#include "cli/flags.h"

#include <d2s1r/CFusionBackend.h>
#include <d2s1r/atlas.h>

#include <optional>
#include <string>
#include <vector>

namespace d2s1r::app
{
/// Loads the map file and builds its index, and tells on a terminal that it does.
/// \throws UserError (kBadInput; kWrongUse if the region lies outside the map; kInterrupted)
CSignatureMap2D::ConstPtr build_map(const Flags& flags, const Parameters& parameters, Console& console);

/// Where the index of the map came from.
struct IndexUse
{
	bool loaded = false;    //!< whether it was loaded from the file of --index
	std::string why_built;  //!< if it was not, and --index was given: why
};

/// A map with its index.
struct IndexedMap
{
	AtlasEntry entry;  //!< its name is empty if there is only one map, which is no atlas
	CSignatureMap2D::ConstPtr map;
	IndexUse use;
};

/// Returns the maps that the command line names. \throws UserError (kBadInput if an atlas cannot be read; kWrongUse if
/// an option is about one map and there are several)
std::vector<AtlasEntry> map_entries(const Flags& flags);

/// Returns the file of --index for one of these maps.
std::string index_file_of(const AtlasEntry& entry, const Flags& flags);

/// Loads all maps or their indices, saves those of --index, and tells what makes them doubtful.
/// \throws UserError
std::vector<IndexedMap> load_maps(const Flags& flags, const Parameters& parameters, Console& console);

/// Returns the atlas of several maps; no value if there is one map, which is no atlas.
/// \throws UserError (kWrongUse) if they do not go together
std::optional<Atlas> atlas_of(const std::vector<IndexedMap>& maps);

/// Returns the maps for a fusion back-end.
std::vector<FusionMap> fusion_maps(const std::vector<IndexedMap>& maps);

/// Returns what makes it doubtful that scans will be found in the map, a line each.
/// \param map that build_map() built
std::vector<std::string> doubts_about_map(const Flags& flags, const Localizer& map);
}  // namespace d2s1r::app
