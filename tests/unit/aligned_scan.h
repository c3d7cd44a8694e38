// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Scans that tests of the coarse search can compare with profiles by plain loops.
#pragma once

#include <algorithm>

#include "coarse/coarse_kernel.h"
#include "coarse/range_profiles.h"
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

/// The range [step] that a number of kPredictions stands for in a direction of a row of the overview.
inline std::uint8_t literal_prediction(
    const std::uint8_t* overview, std::size_t direction, std::size_t directions, std::size_t number)
{
	const auto [turn, more] = kPredictions[number];
	const auto count = static_cast<int>(directions);
	const int turned = ((static_cast<int>(direction) + turn) % count + count) % count;
	return static_cast<std::uint8_t>(std::clamp(2 * overview[turned] + more, 0, 255));
}

/// All ranges [step] of the profiles, by position, then by direction.
inline std::vector<std::uint8_t> literal_rows(const RangeProfiles& profiles)
{
	const auto directions = static_cast<std::size_t>(profiles.directions);
	const std::size_t stride = profiles.predictions_stride();
	std::vector<std::uint8_t> rows;
	for (std::size_t group = 0; group < profiles.groups(); group++)
		for (std::size_t i = profiles.first_of_group[group]; i < profiles.first_of_group[group + 1]; i++)
			for (std::size_t d = 0; d < directions; d++)
			{
				const std::uint8_t byte = profiles.predictions[i * stride + d % stride];
				const std::size_t number = d < stride ? byte & 15U : byte >> 4U;
				rows.push_back(literal_prediction(profiles.overview_of(group), d, directions, number));
			}
	return rows;
}
}  // namespace d2s1r::test
