// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/odometry_check.h>
#include <d2s1r/pseudo_odometry.h>

#include <algorithm>

namespace d2s1r
{
std::optional<mrpt::poses::CPose2D> OdometryCheck::checked(
    const std::optional<mrpt::poses::CPose2D>& increment, const Localization& localization)
{
	constexpr double kNewest = 0.2, kOutlier = 30, kMost = 12;  // [-] share in the average; of a motion; of the average
	const auto now = localization.status == Status::kLocalized ? std::optional(localization.best()) : std::nullopt;
	const bool is_usable = increment && is_plausible(*increment);
	if (before_ && now && is_usable)
	{
		const double distance = mahalanobis_distance(odometry_motion(*increment), increment_between(*before_, *now));
		disagreement_ += kNewest * (std::min(distance * distance, kOutlier) - disagreement_);
	}
	before_ = now;
	return is_usable && disagreement_ <= kMost ? increment : std::nullopt;
}
}  // namespace d2s1r
