// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "input/map_doubts.h"

#include <d2s1r/lost_cells.h>
#include <mrpt/core/format.h>

#include "cli/console.h"

namespace d2s1r::app
{
namespace
{
/// Says what the yaml file of a map makes of its image that was hardly meant.
std::vector<std::string> doubts_about_cells(const LostCells& lost)
{
	constexpr double kLeast = 0.01;       // [-] share of an image that is worth a word
	constexpr double kLeastWalls = 1e-3;  // [-] the same of walls, which are thin
	std::vector<std::string> doubts;
	const auto add = [&](double share, double least, const std::string& what, const std::string& to_do)
	{
		if (share <= least) return;
		doubts.push_back(
		    mrpt::format("%s, which is %.0f %% of the image; %s", what.c_str(), 100 * share, to_do.c_str()));
	};
	switch (lost.cause)
	{
		case LostCells::Cause::kFreeThresh:  // as in every map that nav2 saves: see diagnose()
			break;
		case LostCells::Cause::kAlpha:
			add(lost.unknown_made_free, kLeast,
			    "its alpha channel, which map_server averages with the colours, puts the grey 205 of unknown cells "
			    "below free_thresh and makes them free",
			    "save the image without alpha channel");
			break;
		case LostCells::Cause::kScale:
			add(lost.unknown_made_free, kLeast, "its mode: scale makes the grey 205 of unknown cells free",
			    "make these pixels transparent, or set mode to trinary");
			break;
	}
	add(lost.transparent_made_known, kLeast, "its transparent pixels become free or occupied cells",
	    "set mode to scale, which leaves them unknown, or paint them with the grey 205");
	add(lost.free_made_unknown, kLeast, "most of its light greys lie above free_thresh and become unknown cells",
	    "set mode to scale, or raise free_thresh");
	add(lost.walls_made_unknown, kLeastWalls,
	    "most of its dark greys lie below occupied_thresh and become unknown cells",
	    "set mode to scale, or lower occupied_thresh");
	add(lost.rooms_made_unknown, kLeast,
	    "shades between its thresholds, such as rooms in colours, become unknown cells",
	    mrpt::format(
	        "free_thresh: %.2f and occupied_thresh: %.2f read them as free", lost.free_above_rooms,
	        lost.occupied_above_rooms));
	add(lost.beyond_raw, kLeast, "its mode: raw reads pixels from 101 to 254 as unknown cells",
	    "set mode to trinary or scale");
	return doubts;
}
}  // namespace

std::vector<std::string> doubts_about_map(const std::string& file, const Localizer& map)
{
	constexpr double kCoarsest = 0.1001;      // [m] see README
	constexpr double kMostOpenBorder = 0.95;  // [-] of outdoor maps that lasers drew, 0.87 of the border is open
	constexpr double kSolid = 0.3;            // [m] walls that are all thicker than this are drawn so, not smeared
	const MapMeasure& measure = map.measure();
	const double cell = map.grid().cell_size;
	const SilentDescriptors silence;  // decoders of images print
	const LostCells lost =
	    read_interruptibly(file, [file, grid = map.parameters().grid] { return lost_cells(file, grid); });
	std::vector<std::string> doubts = doubts_about_cells(lost);
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
		    "even its thin walls are %.2f m thick: if those of the building are not, it is smeared, and poses are less "
		    "exact than in a sharp map; draw it again from scans whose poses are better, or without margins",
		    measure.wall_thickness));
	return doubts;
}
}  // namespace d2s1r::app
