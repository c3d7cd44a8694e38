// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "odometry_between_scans.h"

#include <d2s1r/pseudo_odometry.h>

#include <utility>

namespace d2s1r::app
{
void OdometryBetweenScans::add(const RawlogObject& object)
{
	has_news_ = has_news_ || object.odometry || object.increment;
	if (object.odometry) now_ = object.odometry;
	if (object.increment) now_ = now_.value_or(mrpt::poses::CPose2D()) + *object.increment;
}

std::optional<mrpt::poses::CPose2D> OdometryBetweenScans::take()
{
	std::optional<mrpt::poses::CPose2D> increment;
	if (!std::exchange(has_news_, false)) now_.reset();  // not the same as standing still
	if (now_ && then_) increment = *now_ - *then_;
	if (increment && !is_plausible(*increment)) increment.reset(), now_.reset();
	then_ = now_;
	return increment;
}
}  // namespace d2s1r::app
