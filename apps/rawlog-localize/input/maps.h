// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/atlas.h>
#include <shell/indexed_maps.h>

#include <optional>
#include <vector>

#include "cli/command_line.h"

namespace d2s1r::app
{
/// Returns what the maps of a command line are made from. \throws UserError (kBadInput if an atlas cannot be read;
/// kWrongUse if an option is about one map and there are several)
std::vector<MapSource> map_sources(const CommandLine& command);

/// Reads the parameters of all maps. \param parameters of those that have none of their own
/// \throws UserError (kWrongUse)
void set_parameters(std::vector<MapSource>& sources, const Parameters& parameters, const CommandLine& command);

/// Waits as a program at a terminal does: it shows what is being done, and gives up when it is interrupted.
Wait waiting_at(Console& console);

/// Refuses a log that is given as the map, and says so if map and log seem to be swapped. \throws UserError
void check_not_swapped(const CommandLine& command);

/// Loads all maps or their indices, saves those of --index, and tells what makes them doubtful and
/// which yaml files of a folder are no maps.
/// \throws UserError
std::vector<IndexedMap> load_maps(const std::vector<MapSource>& sources, const CommandLine& command, Console& console);

/// Returns the atlas of the maps, also of one.
/// \throws UserError (kWrongUse) if they do not go together
Atlas atlas_of(const std::vector<IndexedMap>& maps);
}  // namespace d2s1r::app
