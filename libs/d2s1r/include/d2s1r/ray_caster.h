// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

namespace d2s1r
{
/// Virtual scans from arbitrary poses by exact grid traversal, skipping free space with a distance transform.
/// Const and thread-safe.
class RayCaster
{
   public:
	/// Keeps a reference to `grid`.
	RayCaster(const Grid& grid, double max_range, bool stop_at_unknown);

	/// Distance [m] from (x, y) [m, map frame] along `angle` [rad] to the near side of the first obstacle; max_range if
	/// none. Zero inside an obstacle.
	float cast(double x, double y, double angle) const;

   private:
	const Grid* grid_;
	double max_range_;
	bool stop_at_unknown_;
};
}  // namespace d2s1r
