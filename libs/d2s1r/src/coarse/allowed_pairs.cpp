// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/allowed_pairs.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

namespace d2s1r
{
mrpt::math::TPose2D pose_of(const RangeProfiles& profiles, const Match& match)
{
	const auto i = static_cast<std::size_t>(match.position);
	const double yaw = mrpt::math::wrapToPi(2 * M_PI * match.shift / profiles.directions);
	return {static_cast<double>(profiles.x[i]), static_cast<double>(profiles.y[i]), yaw};
}

AllowedPairs::AllowedPairs(
    const RangeProfiles& profiles, const Prior& prior, const Scan& scan, const CoarseSearchParameters& parameters)
    : profiles_(profiles),
      prior_(prior),
      anywhere_(prior.anywhere()),
      offset_(std::hypot(scan.sensor_on_robot.x, scan.sensor_on_robot.y)),
      spacing_(parameters.spacing),
      yaw_(mrpt::DEG2RAD(parameters.distinct_yaw)),
      robot_on_sensor_(mrpt::math::TPose2D() - scan.sensor_on_robot)
{
}

bool AllowedPairs::prior_allows(const Match& match) const
{
	return prior_.allows(pose_of(profiles_, match) + robot_on_sensor_, spacing_ + offset_ * yaw_, yaw_);
}

bool AllowedPairs::prior_allows_any(const Match& of_group) const
{
	const std::size_t* const first = profiles_.first_of_group.data() + of_group.position;
	bool any = false;
	for (std::size_t i = first[0]; i < first[1] && !any; i++)
		any = prior_allows({static_cast<std::int32_t>(i), of_group.shift, 0});
	return any;
}

std::vector<std::uint64_t> AllowedPairs::groups() const
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	std::vector<std::uint64_t> allowed((profiles_.groups() + kBlock - 1) / kBlock);
	if (anywhere_)
	{
		std::fill(allowed.begin(), allowed.end(), ~std::uint64_t{0});
		if (profiles_.groups() % kBlock != 0) allowed.back() >>= kBlock - profiles_.groups() % kBlock;
		return allowed;
	}
	for (std::size_t group = 0; group < profiles_.groups(); group++)
	{
		bool any = false;
		for (std::size_t i = profiles_.first_of_group[group]; i < profiles_.first_of_group[group + 1] && !any; i++)
			any = prior_.allows_position(
			    static_cast<double>(profiles_.x[i]), static_cast<double>(profiles_.y[i]), offset_ + spacing_);
		if (any) allowed[group / kBlock] |= std::uint64_t{1} << group % kBlock;
	}
	return allowed;
}
}  // namespace d2s1r
