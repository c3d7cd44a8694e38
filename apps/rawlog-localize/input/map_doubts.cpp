// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "input/map_doubts.h"

#include "cli/console.h"

#include <d2s1r/for_programs.h>
#include <mrpt/core/format.h>

namespace d2s1r::app
{
std::vector<std::string> doubts_about_map(const std::string& file, const Localizer& map)
{
	constexpr double kLeastUnknown = 0.01;    // [-] share of an image that is worth a word
	constexpr double kCoarsest = 0.1001;      // [m] see README
	constexpr double kMostOpenBorder = 0.95;  // [-] of outdoor maps that lasers drew, 0.87 of the border is open
	constexpr double kSolid = 0.3;            // [m] walls that are all thicker than this are drawn so, not smeared
	const MapMeasure measure = map.measure();
	const double cell = map.grid().cell_size;
	std::vector<std::string> doubts;
	const SilentDescriptors silence;  // decoders of images print
	const double share = read_interruptibly(file, [file] { return unknown_made_free(file); });
	if (share > kLeastUnknown)
		doubts.push_back(mrpt::format(
		    "its free_thresh makes the grey 205 of unknown cells free, which is %.0f %% of the image; set free_thresh "
		    "to 0.196",
		    100 * share));
	if (cell > kCoarsest)
		doubts.push_back(mrpt::format(
		    "its cells of %.2f m are too coarse for scans to match; use a map with cells of 0.01 to 0.1 m", cell));
	if (measure.wall_area == 0)
		doubts.push_back("it has no walls; check the image, occupied_thresh and negate, or grid.occupied_threshold");
	else if (measure.open_border > kMostOpenBorder)
		doubts.push_back(mrpt::format(
		    "no wall bounds %.0f %% of the border of its free space; check occupied_thresh, or whether walls are lost "
		    "in the image",
		    100 * measure.open_border));
	if (measure.surface_depth > 0.5 * cell && measure.wall_thickness < kSolid)
		doubts.push_back(mrpt::format(
		    "even its thin walls are %.2f m thick: it is smeared, and poses are less exact than in a sharp map; draw "
		    "it "
		    "again from scans whose poses are better, or without margins",
		    measure.wall_thickness));
	return doubts;
}
}  // namespace d2s1r::app
