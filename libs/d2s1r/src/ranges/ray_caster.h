// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace d2s1r
{
/// One byte for each cell of a grid and of a margin of one cell around it: how far a ray may go in any direction.
struct SkipMap
{
	int width = 0;   //!< [cells] with the margin
	int height = 0;  //!< [cells] with the margin
	/// [cells] Chebyshev distance to the nearest obstacle or cell of the margin, at most 255, row-major; followed by
	/// kGatherOverrun bytes.
	std::vector<std::uint8_t> cells;

	std::size_t index(int column, int row) const
	{
		return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
	}
	bool is_inside(int column, int row) const
	{
		return column > 0 && row > 0 && column < width - 1 && row < height - 1;
	}
};

/// Unit vectors, padded to whole SIMD vectors.
struct RayDirections
{
	std::size_t size = 0;
	std::vector<float> dx;
	std::vector<float> dy;
};

/// Virtual scans from arbitrary poses by exact grid traversal; whole squares of free space are crossed in one step.
/// Const and thread-safe. Needs one byte per cell of the grid.
class RayCaster
{
   public:
	/// \param max_range [m]
	/// \param stop_at_unknown whether unknown cells, and all that lies outside of the grid, end a ray
	RayCaster(const Grid& grid, double max_range, bool stop_at_unknown);

	/// Distance [m] from (x, y) [m, map frame] along `angle` [rad] to the near side of the first obstacle; max_range if
	/// none. Zero inside an obstacle.
	float cast(double x, double y, double angle) const;

	/// Ranges [m] from (x, y) [m, map frame] along `directions` directions; direction i points at 2 pi i / directions.
	/// Several rays at a time in single precision: a ray that grazes a corner may pass it on the other side than cast()
	/// says.
	std::vector<float> scan(double x, double y, int directions) const;

	/// The same into `ranges`, without allocation if that was large enough once.
	void scan(double x, double y, int directions, std::vector<float>& ranges) const;

   private:
	double cell_size_, origin_x_, origin_y_;  //!< [m] of the grid, map frame
	double max_range_;                        //!< [m]
	bool stop_at_unknown_;
	SkipMap skips_;
};
}  // namespace d2s1r
