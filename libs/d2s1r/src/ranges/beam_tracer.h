// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include "scan/beam_subset.h"

namespace d2s1r
{
/// What lies along beams, and where they end; padded as BeamArrays.
struct TracedBeams
{
	/// [-] walls passed: runs of occupied cells that a beam entered and left, except right before its end. A corner
	/// that is cut over less than one cell counts by the part of a cell
	std::vector<float> walls;
	std::vector<float> unknown;     //!< [m] in unknown space, outside of the grid included
	std::vector<std::int32_t> end;  //!< Cell of the end point; unknown outside of the grid. If the sensor is outside,
	                                //!< all are, and nothing is followed
};

/// The cells of a BeamTracer, as its kernel sees them.
struct PackedCells
{
	const std::uint8_t* cells;
	int width, height;  //!< [cells] margin included
	double cell_size;   //!< [m]
};

/// Follows beams through walls, free and unknown space, many at a time; squares of one class are crossed in one step.
/// One byte per cell of the grid. Const and thread-safe.
class BeamTracer
{
   public:
	explicit BeamTracer(const Grid& grid);

	/// Follows all `beams` of a sensor at `sensor` [m, rad, map frame]; the same result with every kind of SIMD.
	void trace(const BeamArrays& beams, const mrpt::math::TPose2D& sensor, TracedBeams& traced) const;

	/// The same ends of the beams, as if these passed nothing: not followed, much faster.
	void locate_ends(const BeamArrays& beams, const mrpt::math::TPose2D& sensor, TracedBeams& traced) const;

	static constexpr int kClassBits = 2;

   private:
	void trace(const BeamArrays& beams, const mrpt::math::TPose2D& sensor, bool only_ends, TracedBeams& traced) const;

	int width_, height_;  //!< [cells] of the grid and a margin of one cell around it
	double cell_size_, origin_x_, origin_y_;
	/// Class in the two low bits; above, Chebyshev distance [cells] to the nearest cell of another class, at most 63,
	/// or 0 in the margin. Followed by a few bytes, because cells are gathered as words of four bytes.
	std::vector<std::uint8_t> cells_;
};
}  // namespace d2s1r
