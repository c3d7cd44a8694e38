// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/output_file.h>
#include <d2s1r/grid.h>
#include <d2s1r/gzip_file.h>

#include <string>
#include <vector>

#include "frames/logged_scan.h"
#include "picture/sheet.h"

namespace d2s1r::app
{
/// Refers to what is drawn into a scene.
struct SceneContent
{
	const Grid& grid;
	const std::vector<MapName>& names;  //!< of the maps on a sheet; empty if there is one map
	const DrawnFrames& frames;
	ScanPtr last_scan;   //!< of the last localized frame; null if there is none
	bool fused = false;  //!< whether frames have fused poses
};

/// Writes scene.3Dscene for MRPT's SceneViewer3D, with objects named "grid", "trajectory", "hypotheses",
/// "map_names" (only if there are several maps), "fused_trajectory" (only if there is one) and "last_scan" (only if a
/// frame was localized). \throws UserError (kBadOutput)
void write_scene(const SceneContent& content, GzipFile& file);
}  // namespace d2s1r::app
