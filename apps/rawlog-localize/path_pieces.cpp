// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "path_pieces.h"

#include <algorithm>
#include <cmath>

namespace d2s1r::app
{
namespace
{
constexpr double kGreatestSpeed = 2.0;     //!< [m/s]
constexpr double kAlwaysPossible = 0.5;    //!< [m] between frames: poses have errors, clocks too
constexpr double kGreatestDistance = 5.0;  //!< [m] between frames, however long they took
}  // namespace

bool is_jump(const mrpt::math::TPose2D& from, const mrpt::math::TPose2D& to, double seconds)
{
	const double possible = std::min(kAlwaysPossible + kGreatestSpeed * std::abs(seconds), kGreatestDistance);
	return std::hypot(to.x - from.x, to.y - from.y) > possible;
}

std::vector<std::vector<const Frame*>> path_pieces(const std::vector<Frame>& frames)
{
	std::vector<std::vector<const Frame*>> pieces;
	const Frame* last = nullptr;
	for (const auto& frame : frames)
	{
		if (!frame.localized())
		{
			last = nullptr;
			continue;
		}
		const bool continues = last && !is_jump(
		                                   last->result.best().pose.asTPose(), frame.result.best().pose.asTPose(),
		                                   frame.timestamp - last->timestamp);
		if (!continues) pieces.emplace_back();
		pieces.back().push_back(&frame);
		last = &frame;
	}
	return pieces;
}
}  // namespace d2s1r::app
