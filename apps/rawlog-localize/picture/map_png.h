// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/output_file.h>
#include <d2s1r/grid.h>

#include "evaluation/run_report.h"
#include "picture/sheet.h"

namespace d2s1r::app
{
/// Whether this build draws map.png, which it does by cairo.
extern const bool kDrawsMapPng;

/// Writes map.png: the known part of the map with ground truth, path, headings, hypotheses, fused path, wrong frames,
/// the names of several maps, legend and scale bar.
/// \param names of the maps on a sheet; empty if there is one map
/// \throws UserError (kBadOutput)
void write_map_png(
    const RunReport& report, const DrawnFrames& frames, const Grid& map, const std::vector<MapName>& names,
    const PendingFile& file);
}  // namespace d2s1r::app
