// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "test_maps.h"

namespace d2s1r::test
{
/// Two rooms that are alike on a corridor whose ends are not.
inline Grid make_twin_rooms()
{
	return make_picture_grid(
	    enlarge(
	        {"######################",  //
	         "#......##......#######",  //
	         "#......##......##....#",  //
	         "#.#....##.#....##....#",  //
	         "#......##......##....#",  //
	         "###..######..#####..##",  //
	         "#....................#",  //
	         "#....................#",  //
	         "######################"},
	        10),
	    0.05);
}

/// From the left end of the corridor into the left room.
inline std::vector<mrpt::math::TPose2D> into_left_room()
{
	std::vector<mrpt::math::TPose2D> path;
	for (int i = 0; i <= 4; i++) path.push_back({0.9 + 0.3 * i, 0.9, 0.1 * i});
	for (int i = 1; i <= 6; i++) path.push_back({2.1, 0.9 + 0.35 * i, 0.4 + 0.2 * i});
	return path;
}
}  // namespace d2s1r::test
