// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/array.h"

namespace d2s1r
{
/// The skip distance of each cell of a grid, and of a margin of one cell around it: how far a ray may go in any
/// direction.
struct SkipMap
{
	int width = 0;   //!< [cells] with the margin
	int height = 0;  //!< [cells] with the margin
	/// [cells] Chebyshev distance to the nearest obstacle or cell of the margin, at most 255, row-major. kGatherOverrun
	/// bytes follow.
	Array<std::uint8_t> cells;

	/// Returns the position of a cell in `cells`.
	std::size_t index(int column, int row) const
	{
		return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
	}

	/// Returns whether a cell is inside of the margin.
	bool is_inside(int column, int row) const
	{
		return column > 0 && row > 0 && column < width - 1 && row < height - 1;
	}
};

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
	/// Prepares the cells of `grid`.
	/// \param max_range [m] of a ray
	RayCaster(const Grid& grid, double max_range);

	/// Makes an empty one, for fields() to read into.
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

	/// Lists what an index file holds of the caster.
	template <class Self, class File>
	static void fields(Self& self, File& file)
	{
		file(self.cell_size_);
		file(self.origin_x_);
		file(self.origin_y_);
		file(self.max_range_);
		file(self.skips_.width);
		file(self.skips_.height);
		file(self.skips_.cells);
	}

   private:
	double cell_size_ = 0, origin_x_ = 0, origin_y_ = 0;  //!< [m] of the grid, map frame
	double max_range_ = 0;                                //!< [m]
	SkipMap skips_;
};
}  // namespace d2s1r
