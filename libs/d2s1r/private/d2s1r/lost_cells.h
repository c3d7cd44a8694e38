// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/parameters.h>

#include <string>

namespace d2s1r
{
/// Says what became of pixels of a yaml map whose shades were meant in another way. All shares are of the image, and
/// they are about the finished cells, whichever line of the yaml file, channel of the image or threshold made them.
struct LostCells
{
	/// Says what makes unknown cells free.
	enum class Cause
	{
		kFreeThresh,  //!< their occupancy is below free_thresh, which map_server's 0.25 is often seen to be
		kAlpha,       //!< the alpha channel counts as a colour in mode trinary
		kScale        //!< mode scale knows no unknown shade
	};

	bool is_negated = false;       //!< whether the yaml file says negate: 1
	double unknown_made_free = 0;  //!< [0, 1] pixels of the shade of unknown cells, 205, that are free cells
	Cause cause = Cause::kFreeThresh;
	double right_free_thresh = 0;  //!< [probability] that leaves this shade unknown
	/// [0, 1] Pixels that are more transparent than not, but free or occupied cells.
	double transparent_made_known = 0;
	/// [0, 1] Light greys that are unknown cells, if they are more than those that are free.
	double free_made_unknown = 0;
	/// [0, 1] Dark greys that are unknown cells, if they are more than those that are occupied.
	double walls_made_unknown = 0;
	/// [0, 1] Pixels of several shades between the thresholds, all lighter than the walls, as of rooms in colours.
	double rooms_made_unknown = 0;
	double free_above_rooms = 0, occupied_above_rooms = 0;  //!< [probability] thresholds that read them as free
	/// [0, 1] In mode raw: pixels from 101 to 254, which mean nothing there.
	double beyond_raw = 0;
	/// Whether the image looks as if it was made for mode raw, which the yaml file does not say: all its pixels are up
	/// to 100, or 255.
	bool is_like_raw = false;
};

/// Looks at the cells of a yaml map; other maps have lost none.
/// \throws std::runtime_error saying what is wrong, without the name of the yaml file
LostCells lost_cells(const std::string& file, const GridParameters& parameters = {});
}  // namespace d2s1r
