// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

namespace d2s1r
{
/// What lies along a beam before its end.
struct Passed
{
	int walls = 0;      //!< [-] runs of occupied cells the beam came out of, except right before its end
	float unknown = 0;  //!< [m] in unknown space, outside of the grid included
};

/// Follows beams through walls, free and unknown space; squares of one class are crossed in one step. One byte a cell
/// of the grid. Const and thread-safe.
class BeamTracer
{
   public:
	explicit BeamTracer(const Grid& grid);

	/// From (x, y) [m, map frame] along the unit vector (dx, dy) over `range` [m].
	Passed trace(double x, double y, double dx, double dy, double range) const;

	/// Class of the cell at (x, y) [m, map frame]; unknown outside of the grid.
	Cell at(double x, double y) const;

   private:
	int width_, height_;
	double cell_size_, origin_x_, origin_y_;
	/// Class in the two low bits; above, Chebyshev distance [cells] to the nearest cell of another class, at most 63.
	std::vector<std::uint8_t> cells_;
};
}  // namespace d2s1r
