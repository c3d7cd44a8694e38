// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <utility>
#include <vector>

#include "ranges/skip_distances.h"
#include "scan/beam_subset.h"

namespace d2s1r
{
/// What lies along beams, and where they end; padded as BeamArrays are.
struct TracedBeams
{
	/// [-] Walls that a beam passed: runs of occupied cells that it entered and left, except right before its end. A
	/// corner that is cut over less than one cell counts by the part of a cell. Furniture is no wall.
	std::vector<float> walls;
	/// [m] Way of a beam through unknown space, which includes all that is outside of the grid.
	std::vector<float> unknown;
	/// Class (Cell) of the cell that a beam ends in; unknown outside of the grid. If the sensor itself is outside, no
	/// beam is followed, and all ends are unknown.
	std::vector<std::int32_t> end;
};

/// Follows beams through walls, free and unknown space, many at a time; squares of one class are crossed in one step.
/// It needs one byte per cell of the grid. Const and thread-safe.
class BeamTracer
{
   public:
	/// Follows beams through the cells of `map`. \param reading 0: as it is drawn; 1: with the surfaces deeper
	BeamTracer(SkipMap map, int reading) : map_(std::move(map)), reading_(reading) {}

	/// Follows beams through the cells of `grid`. \param furniture cells that are no wall where they are occupied: see
	/// find_furniture()
	explicit BeamTracer(const Grid& grid, const std::vector<CellIndex>& furniture = {})
	    : BeamTracer(make_skip_map(grid, furniture), 0)
	{
	}

	BeamTracer() = default;

	/// Follows all `beams` of a sensor at `sensor` (in map, m and rad). Every kind of SIMD gives the same result.
	void trace(const BeamArrays& beams, const mrpt::math::TPose2D& sensor, TracedBeams& traced) const;

	/// Finds only where the beams end, as if they passed nothing. This is much faster, because no beam is followed.
	void locate_ends(const BeamArrays& beams, const mrpt::math::TPose2D& sensor, TracedBeams& traced) const;

	/// Returns whether a sensor may stand at `sensor` (in map, m and rad): in free space, or a little beyond its
	/// border, where nobody has looked. In and behind walls beams tell nothing: outside of the grid none is followed,
	/// and in a wall all of them end at it.
	bool may_stand(const mrpt::math::TPose2D& sensor) const
	{
		constexpr double kBesideFree = 0.3;  // [m]
		return map_.may_stand(sensor.x, sensor.y, kBesideFree, reading_);
	}

	const SkipMap& map() const { return map_; }

   private:
	void trace(const BeamArrays& beams, const mrpt::math::TPose2D& sensor, bool only_ends, TracedBeams& traced) const;

	SkipMap map_;
	int reading_ = 0;
};
}  // namespace d2s1r
