// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ranges/skip_distances.h"

namespace d2s1r
{
/// The unit vectors of rays, padded to whole SIMD vectors.
struct RayDirections
{
	std::size_t size = 0;   //!< [-] without the padding
	std::vector<float> dx;  //!< [-]
	std::vector<float> dy;  //!< [-]
};

/// Casts rays from arbitrary positions by exact grid traversal; whole squares of free space are crossed in one step. It
/// needs one byte per cell of the grid. Const and thread-safe.
class RayCaster
{
   public:
	/// Casts rays through the cells of `map`, as it is drawn.
	/// \param max_range [m] of a ray
	RayCaster(SkipMap map, double max_range) : max_range_(max_range), map_(std::move(map)) {}

	/// Casts rays through the cells of `grid`.
	/// \param max_range [m] of a ray
	RayCaster(const Grid& grid, double max_range) : RayCaster(make_skip_map(grid), max_range) {}

	RayCaster() = default;

	/// Returns the distance [m] from (x, y) [m, map frame] along `angle` [rad] to the near side of the first occupied
	/// cell, or max_range if there is none; zero inside one. Unknown cells, as which all outside of the grid counts,
	/// end no ray.
	float cast(double x, double y, double angle) const;

	/// Returns a virtual scan: the ranges [m] from (x, y) [m, map frame] along `directions` directions, of which
	/// direction i points at 2 pi i / directions. Several rays are followed at a time in single precision, so that a
	/// ray which grazes a corner may pass it on the other side than cast() says.
	std::vector<float> scan(double x, double y, int directions) const;

	/// Writes a virtual scan into `ranges`, without allocation if that was large enough once.
	void scan(double x, double y, int directions, std::vector<float>& ranges) const;

	template <class Self, class File>
	static void fields(Self& self, File& file)
	{
		file(self.max_range_);
		SkipMap::fields(self.map_, file);
	}

   private:
	double max_range_ = 0;  //!< [m]
	SkipMap map_;
};
}  // namespace d2s1r
