// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/atlas.h>

#include <string>
#include <vector>

namespace d2s1r
{
/// Returns the name that a map gets by its file: without folder, extension and that of a compressed file.
std::string map_name_of(const std::string& file);

/// Returns a line that names the maps of a folder, and the yaml files in it that read_atlas() has left out because they
/// describe no map. The line is empty if there are no such files, or if `path` is not a folder.
/// \param entries what read_atlas(path) returned
std::string files_that_are_no_maps(const std::string& path, const std::vector<AtlasEntry>& entries);
}  // namespace d2s1r
