// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Real buildings that are not part of the project. Tests that need them skip, saying so, where they are absent.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace d2s1r::test
{
/// The folder of the sites: the environment variable D2S1R_DATA, else ../shared/data beside the project.
inline std::filesystem::path sites_folder()
{
	if (const char* folder = std::getenv("D2S1R_DATA")) return folder;
	return std::filesystem::path(D2S1R_SOURCE_DIR) / "../shared/data";
}

inline std::string why_skipped(const std::filesystem::path& missing)
{
	return "NO DATA: " + missing.string() + " is absent; set D2S1R_DATA to the folder of the sites";
}
}  // namespace d2s1r::test
