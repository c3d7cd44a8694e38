// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/tracker_check.h"

#include <mrpt/math/wrap2pi.h>

#include <iterator>

namespace d2s1r::app
{
namespace
{
using mrpt::poses::CPose2D;

constexpr double kAtOnce = 1.0005e-3;      //!< [s] 1 ms and what six decimals round off
constexpr double kLongestSilence = 0.5;    //!< [s] between two poses of a tracker that another is made between
constexpr double kStillGoodWithout = 0.2;  //!< [s] that a pose may be old if nobody measured the motion since

CPose2D share_of(const CPose2D& motion, double share)
{
	return {share * motion.x(), share * motion.y(), share * motion.phi()};
}
}  // namespace

/// A tracker that jumps does so at once: what is between two of its poses is only used without odometry.
std::optional<CPose2D> TrackerCheck::between_lines(double time) const
{
	const auto after = path_.upper_bound(time + kAtOnce);
	const auto before = std::prev(after);
	if (after != path_.end() && after->first - before->first <= kLongestSilence)
	{
		const double share = std::max(0.0, (time - before->first) / (after->first - before->first));
		const auto &from = before->second, &to = after->second;
		return CPose2D(
		    from.x + share * (to.x - from.x), from.y + share * (to.y - from.y),
		    from.phi + share * mrpt::math::wrapToPi(to.phi - from.phi));
	}
	if (time - before->first <= kStillGoodWithout) return CPose2D(before->second);
	return std::nullopt;
}

/// The newest pose that the tracker told, moved on by the odometry since.
std::optional<CPose2D> TrackerCheck::pose_at(double time, const std::optional<CPose2D>& motion) const
{
	const auto after = path_.upper_bound(time + kAtOnce);
	if (after == path_.begin()) return std::nullopt;
	const auto& [told_at, told] = *std::prev(after);
	const double age = time - told_at;  // [s]
	if (age <= kAtOnce) return CPose2D(told);
	if (!motion || !last_time_) return between_lines(time);
	if (told_at > *last_time_) return CPose2D(told) + share_of(*motion, age / (time - *last_time_));
	return tracker_ ? std::optional(*tracker_ + *motion) : between_lines(time);
}

CheckedTracker TrackerCheck::add(
    const Localizer& localizer, const Scan& scan, double time, const Localization& localization,
    const std::optional<CPose2D>& motion)
{
	tracker_ = pose_at(time, motion);
	last_time_ = time;
	CheckedTracker checked{monitor_.add(localizer, scan, localization, motion, tracker_)};
	if (tracker_) checked.pose = tracker_->asTPose();
	return checked;
}
}  // namespace d2s1r::app
