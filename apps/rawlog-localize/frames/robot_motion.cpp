// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/robot_motion.h"

#include <algorithm>

namespace d2s1r::app
{
void RobotMotion::add(const logs::RawlogObject& object)
{
	if (object.increment) by_increments_ = by_increments_.value_or(mrpt::poses::CPose2D()) + *object.increment;
	if (!object.odometry) return;
	const auto* reading = dynamic_cast<const mrpt::obs::CObservation*>(object.object.get());
	if (reading) add(logs::to_seconds(reading->timestamp), *object.odometry);
}

void RobotMotion::add_scan(double time)
{
	newest_scan_ = time;
	if (by_increments_) add(time, *by_increments_);
}

void RobotMotion::add(double time, const mrpt::poses::CPose2D& robot)
{
	constexpr double kKept = 5;          // [s]
	constexpr std::size_t kMost = 5000;  // [-]
	if (!(time > 0)) return;
	if (!poses_.empty() && time < poses_.back().time - kKept) poses_.clear();  // the clock was set back
	if (!poses_.empty() && time <= poses_.back().time) return;
	poses_.push_back({time, robot.asTPose()});
	while (poses_.front().time < time - kKept || poses_.size() > kMost) poses_.pop_front();
}

bool RobotMotion::covers(double time) const
{
	constexpr double kEnded = 0.5;  // [s] after which nobody waits for odometry that does not come
	return poses_.empty() || poses_.back().time >= time || newest_scan_ > time + kEnded;
}

std::vector<StampedPose> RobotMotion::around(double stamp, double first, double last) const
{
	const double from = stamp + std::min(first, 0.0), to = stamp + std::max(last, 0.0);
	const auto is_earlier = [](const StampedPose& pose, double time) { return pose.time < time; };
	auto begin = std::lower_bound(poses_.begin(), poses_.end(), from, is_earlier);
	auto end = std::lower_bound(begin, poses_.end(), to, is_earlier);
	// One pose before and one after, or two, so that it can be extrapolated.
	begin -= std::min<std::ptrdiff_t>(2, begin - poses_.begin());
	end += std::min<std::ptrdiff_t>(2, poses_.end() - end);
	std::vector<StampedPose> poses(begin, end);
	for (StampedPose& pose : poses) pose.time -= stamp;
	return poses;
}
}  // namespace d2s1r::app
