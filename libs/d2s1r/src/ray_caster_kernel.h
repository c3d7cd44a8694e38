// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace d2s1r
{
/// One byte for each cell of a grid and of a margin of one cell around it: how far a ray may go in any direction.
struct ClearanceMap
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
struct RayFan
{
	std::size_t size = 0;
	std::vector<float> dx;
	std::vector<float> dy;

	/// Directions 2 pi i / directions.
	static RayFan full_circle(int directions);
};

/// Lengths [cells] of all rays of `fan` from (x, y) [cells of the map] to the cells where the clearance is 0, at most
/// `limit`; many rays at a time in single precision, bit for bit the same whatever SIMD the machine has.
/// \param x, y inside the map's margin
/// \param margin_ends_rays else a ray that leaves the grid has length `limit`
/// \param lengths resized to the padded size of the fan
void follow_rays(
    const ClearanceMap& map, double x, double y, float limit, bool margin_ends_rays, const RayFan& fan,
    std::vector<float>& lengths);
}  // namespace d2s1r
