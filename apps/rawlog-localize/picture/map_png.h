// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/accuracy.h"

#include <d2s1r/grid.h>

#include <vector>

namespace d2s1r::app
{
struct MapPicture
{
	const mrpt::maps::COccupancyGridMap2D& map;
	const GridParameters& thresholds;
	const std::vector<Frame>& frames;
	const GroundTruth& truth;           //!< may be empty
	const std::vector<Match>& matches;  //!< of the frames with it
};

/// Writes map.png: the known part of the map with trajectory, headings, hypotheses, ground truth, failures, legend and
/// scale bar. \throws UserError (kBadOutput)
void write_map_png(const MapPicture& picture, const std::string& path);
}  // namespace d2s1r::app
