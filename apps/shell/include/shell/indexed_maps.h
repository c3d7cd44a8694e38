// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/atlas.h>
#include <d2s1r/map_io.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace d2s1r::app
{
/// Reads the parameters of maps. \param config their ini file; empty: the defaults
/// \param settings "SECTION.KEY=VALUE", which win over it \throws UserError (kWrongUse)
Parameters read_parameters(const std::string& config, const std::vector<std::string>& settings);

/// What one map of a program is made from.
struct MapSource
{
	AtlasEntry entry;                      //!< its name is empty if there is only one map, which is no atlas
	std::string atlas = {};                //!< that lists the map, as messages name it
	std::optional<ImageGeometry> image{};  //!< only if the map is an image
	std::string index = {};                //!< file in which the index is kept; empty: none
	Parameters parameters = {};
	int threads = 1;  //!< [-] for method = paper
};

struct IndexUse
{
	bool loaded = false;    //!< whether it was loaded from its file
	std::string why_built;  //!< if it was not, and there is to be such a file: why
};

struct IndexedMap
{
	AtlasEntry entry;
	std::shared_ptr<const Localizer> localizer;
	IndexUse use;
};

/// Does what takes long for a file, and may say meanwhile what that is. If it gives up waiting, it throws, and the work
/// goes on until the process ends: the work owns all that it uses.
using Wait = std::function<void(const std::string& file, const std::string& doing, const std::function<void()>& work)>;

/// Loads all maps, or their indices, and saves the indices that were built. Map files are read in processes of their
/// own, with limits. What all maps will take together is known before the first index is built.
/// \throws UserError (kBadInput; kWrongUse if the region of the only map lies outside it; kBadOutput if an index cannot
///         be saved), what `wait` throws
std::vector<IndexedMap> load_maps(const std::vector<MapSource>& sources, const Wait& wait);

/// Loads the map file and builds its index, whatever index there is. \throws as load_maps()
std::shared_ptr<const Localizer> build_map(const MapSource& source, const Wait& wait);

/// Returns how much memory [byte] the index of a map takes about. \throws std::runtime_error if there is less
double memory_of_index(const OccupancyMap& map, const Parameters& parameters);

using BuildIndex = std::function<std::shared_ptr<const Localizer>()>;

/// Loads an index from its file; if that is not the index of this map and these parameters, it builds one and saves it
/// there. \param file of the index; empty: the index is only built
/// \throws UserError (kBadOutput) if the index cannot be saved, before it is built if possible; what `build` throws
IndexedMap index_or_build(
    const std::string& file, std::uint64_t fingerprint, const Parameters& parameters, const BuildIndex& build);

/// Refuses what cannot become the file of an index, while it may still be unknown of which map. An index that is there
/// may be the right one, so that nothing needs to be written. \throws UserError (kBadOutput)
void check_index_file(const std::string& file);
}  // namespace d2s1r::app
