// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The maps that a robot is localized in, from files and from messages.
#pragma once

#include "flags.h"

namespace d2s1r::live
{
/// \throws UserError if a file or a setting is wrong, or the parameters are none of a running robot
Parameters read_parameters(const std::string& config, const std::vector<std::string>& settings);

/// The maps of --map, and a line about files that are left out; it may be empty.
struct LoadedMaps
{
	std::shared_ptr<const Atlas> atlas;
	std::string note;
};

/// Loads the maps of --map, and indexes them. \throws UserError
LoadedMaps load_maps(const Flags& flags, const Parameters& parameters);

/// Makes localizers of the maps that come as messages, with the index that is kept in a file. One that cannot be saved
/// is told; the localizer is there.
MakeLocalizer localizers_with_index(const std::string& file);
}  // namespace d2s1r::live
