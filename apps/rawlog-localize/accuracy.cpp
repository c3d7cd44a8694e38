// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "accuracy.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace d2s1r::app
{
namespace
{
constexpr double kSameTime = 1.0005e-3;  //!< [s] 1 ms and what six decimals round off

Match compare(const TimedPose& truth, const Frame& frame)
{
	constexpr double kInfinite = std::numeric_limits<double>::infinity();
	if (!frame.has_pose()) return {&truth, &frame, kInfinite, kInfinite};
	return compare(truth, frame, frame.result.best().pose.asTPose());
}
}  // namespace

Match compare(const TimedPose& truth, const Frame& frame, const mrpt::math::TPose2D& pose)
{
	return {
	    &truth, &frame, std::hypot(pose.x - truth.pose.x, pose.y - truth.pose.y),
	    mrpt::RAD2DEG(std::abs(mrpt::math::wrapToPi(pose.phi - truth.pose.phi)))};
}

std::vector<Match> match(const std::vector<Frame>& frames, const GroundTruth& truth)
{
	std::vector<const Frame*> by_time;
	for (const auto& frame : frames) by_time.push_back(&frame);
	std::stable_sort(
	    by_time.begin(), by_time.end(), [](const Frame* a, const Frame* b) { return a->timestamp < b->timestamp; });

	std::vector<Match> matches;
	for (const auto& line : truth)
	{
		const Frame* nearest = nullptr;
		double least = kSameTime;
		for (auto it = std::lower_bound(
		         by_time.begin(), by_time.end(), line.timestamp - kSameTime,
		         [](const Frame*frame, double time) { return frame->timestamp < time; });
		     it != by_time.end() && (*it)->timestamp <= line.timestamp + kSameTime; ++it)
		{
			const double difference = std::abs((*it)->timestamp - line.timestamp);
			if (difference < least) nearest = *it, least = difference;
		}
		if (nearest) matches.push_back(compare(line, *nearest));
	}
	return matches;
}

Accuracy measure(const std::vector<Match>& matches, const Tolerance& tolerance)
{
	Accuracy accuracy;
	std::vector<double> position_errors, yaw_errors;
	for (const auto& m : matches)
	{
		const bool right = m.within(tolerance), localized = m.frame->localized();
		accuracy.frames++;
		accuracy.successes += right;
		accuracy.localized += localized;
		accuracy.localized_successes += right && localized;
		if (!right) continue;
		position_errors.push_back(m.position_error);
		yaw_errors.push_back(m.yaw_error);
	}
	accuracy.position_error = mean_std(position_errors);
	accuracy.yaw_error = mean_std(yaw_errors);
	return accuracy;
}
}  // namespace d2s1r::app
