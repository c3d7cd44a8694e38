// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "input/map_doubts.h"

#include <d2s1r/lost_cells.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

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
		case LostCells::Cause::kFreeThresh:
			add(lost.unknown_made_free, kLeast, "its free_thresh makes the grey 205 of unknown cells free",
			    mrpt::format("set free_thresh to %.3f", lost.right_free_thresh));
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
	add(lost.beyond_raw, kLeast, "its mode: raw reads pixels from 101 to 254 as unknown cells",
	    "set mode to trinary or scale");
	return doubts;
}

/// A row of cells through a wall, from free space to free space.
struct Section
{
	int start = 0, cells = 0;
};

/// Returns the sections through walls up to 1.2 m thick along each row, or along each column.
std::vector<std::vector<Section>> sections_of(const Grid& grid, bool along_columns)
{
	constexpr double kThickest = 1.2;  // [m]
	const int lines = along_columns ? grid.width : grid.height, length = along_columns ? grid.height : grid.width;
	const int most = static_cast<int>(kThickest / grid.cell_size);
	std::vector<std::vector<Section>> sections(static_cast<std::size_t>(lines));
	for (int line = 0; line < lines; line++)
	{
		const auto at = [&](int i) { return along_columns ? grid.at(line, i) : grid.at(i, line); };
		int start = -1;  // of the wall behind free space that the line is in
		for (int i = 1; i < length; i++)
		{
			if (at(i) == Cell::kOccupied && at(i - 1) == Cell::kFree) start = i;
			if (at(i) == Cell::kUnknown) start = -1;
			if (at(i) != Cell::kFree || at(i - 1) != Cell::kOccupied || start < 0) continue;
			if (i - start <= most) sections[static_cast<std::size_t>(line)].push_back({start, i - start});
			start = -1;
		}
	}
	return sections;
}

/// How walls go on from one section to the next.
struct Evenness
{
	std::size_t sections = 0;   //!< [-] all
	std::size_t continued = 0;  //!< [-] of these, whose wall goes on for 1 m
	std::size_t even = 0;       //!< [-] of these, where it is straight and of one thickness, to a cell
};

/// Follows the wall of a section for `steps` lines. Returns its sections, fewer if it ends before.
std::vector<Section> follow(
    const std::vector<std::vector<Section>>& sections, std::size_t line, Section section, std::size_t steps)
{
	std::vector<Section> wall = {section};
	for (std::size_t next = line + 1; next <= line + steps && next < sections.size(); next++)
	{
		const auto& others = sections[next];
		const auto goes_on = std::find_if(
		    others.begin(), others.end(),
		    [&](const Section& other) { return std::abs(other.start - wall.back().start) < 3; });
		if (goes_on == others.end()) break;
		wall.push_back(*goes_on);
	}
	return wall;
}

bool is_even(const std::vector<Section>& wall)
{
	constexpr double kOff = 1.5;  // [cells] from a straight line
	const auto is_thinner = [](const Section& a, const Section& b) { return a.cells < b.cells; };
	const auto [thin, thick] = std::minmax_element(wall.begin(), wall.end(), is_thinner);
	if (thick->cells - thin->cells > 1) return false;
	const double slope =
	    static_cast<double>(wall.back().start - wall.front().start) / static_cast<double>(wall.size() - 1);
	for (std::size_t i = 0; i < wall.size(); i++)
		if (std::abs(wall[i].start - wall.front().start - slope * static_cast<double>(i)) > kOff) return false;
	return true;
}

/// Returns whether somebody drew the walls with a ruler, so that they are as thick as they are. Of the plan of a flat,
/// turned by up to 23 deg, 85 % and more of the walls that go on for 1 m are even. Of seven maps that robots drew, and
/// of two that were smeared on purpose, 43 % or less are even, or few walls go on. The bounds were chosen on these
/// maps.
bool are_walls_of_a_plan(const Grid& grid)
{
	constexpr double kLength = 1.0;                     // [m] of a wall that is followed
	constexpr double kMostEven = 0.7, kContinue = 0.2;  // [-] shares
	Evenness evenness;
	const auto steps = static_cast<std::size_t>(std::max(2L, std::lround(kLength / grid.cell_size)));
	for (const bool along_columns : {false, true})
	{
		const auto sections = sections_of(grid, along_columns);
		for (std::size_t line = 0; line < sections.size(); line++)
			for (const Section& section : sections[line])
			{
				const auto wall = follow(sections, line, section, steps);
				evenness.sections++;
				if (wall.size() <= steps) continue;
				evenness.continued++;
				evenness.even += is_even(wall) ? 1 : 0;
			}
	}
	const auto continued = static_cast<double>(evenness.continued);
	return continued > kContinue * static_cast<double>(evenness.sections) &&
	       static_cast<double>(evenness.even) > kMostEven * continued;
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
	if (measure.surface_depth > 0.5 * cell && measure.wall_thickness < kSolid && !are_walls_of_a_plan(map.grid()))
		doubts.push_back(mrpt::format(
		    "even its thin walls are %.2f m thick: it is smeared, and poses are less exact than in a sharp map; draw "
		    "it again from scans whose poses are better, or without margins",
		    measure.wall_thickness));
	return doubts;
}
}  // namespace d2s1r::app
