// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/odometry_track.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>

namespace d2s1r::ros
{
namespace
{
constexpr std::size_t kMostReadings = 1000;

bool is_before(const TimedReading& reading, double time)
{
	return reading.first < time;
}
}  // namespace

void OdometryTrack::add(const TimedReading& reading)
{
	if (!readings_.empty() && reading.first < readings_.front().first) readings_.clear();
	if (!readings_.empty() && reading.first <= readings_.back().first) return;
	readings_.push_back(reading);
	if (readings_.size() > kMostReadings) readings_.pop_front();
}

std::vector<TimedReading> OdometryTrack::over(double start, double end) const
{
	auto first = std::lower_bound(readings_.begin(), readings_.end(), start, is_before);
	auto last = std::lower_bound(first, readings_.end(), end, is_before);
	first -= std::min<std::ptrdiff_t>(2, first - readings_.begin());
	if (last != readings_.end()) ++last;
	return {first, last};
}

std::optional<mrpt::math::TPose2D> OdometryTrack::at(double time) const
{
	const auto after = std::lower_bound(readings_.begin(), readings_.end(), time, is_before);
	if (after == readings_.end()) return std::nullopt;
	if (after->first == time) return after->second;
	if (after == readings_.begin()) return std::nullopt;
	const auto& [t0, a] = *std::prev(after);
	const auto& [t1, b] = *after;
	const double share = (time - t0) / (t1 - t0);
	return mrpt::math::TPose2D(
	    a.x + share * (b.x - a.x), a.y + share * (b.y - a.y),
	    mrpt::math::wrapToPi(a.phi + share * mrpt::math::wrapToPi(b.phi - a.phi)));
}

std::optional<double> OdometryTrack::newest() const
{
	return readings_.empty() ? std::nullopt : std::optional(readings_.back().first);
}
}  // namespace d2s1r::ros
