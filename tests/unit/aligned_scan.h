// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Scans that tests of the coarse search can compare with profiles by plain loops.
#pragma once

#include "test_floor.h"

namespace d2s1r::test
{
/// A scan whose beams lie in the directions of the profiles, `first` to `first + count`.
inline Scan aligned_scan(const Grid& grid, int directions, const mrpt::math::TPose2D& pose, int first, int count)
{
	Scan scan;
	scan.field_of_view = 2 * M_PI * count / directions;
	for (int d = first; d < first + count; d++)
	{
		const double angle = mrpt::math::wrapToPi(2 * M_PI * d / directions);
		const double range = cast_exactly(grid, pose.x, pose.y, pose.phi + angle, 20);
		scan.beams.push_back({static_cast<float>(angle), static_cast<float>(range), range < 20});
	}
	return scan;
}

/// Direction of the profiles in which a beam of an aligned scan lies when turned by `shift` directions.
inline std::size_t direction_of(const Beam& beam, int shift, int directions)
{
	const long turn = std::lround(static_cast<double>(beam.angle) / (2 * M_PI) * directions) + shift;
	return static_cast<std::size_t>((turn + directions) % directions);
}
}  // namespace d2s1r::test
