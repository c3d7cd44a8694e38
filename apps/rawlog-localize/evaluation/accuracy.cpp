// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/accuracy.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace d2s1r::app
{
namespace
{
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

Match compare(const TimedPose& truth, const KeptFrame& frame)
{
	constexpr double kInfinite = std::numeric_limits<double>::infinity();
	if (!frame.has_pose) return {truth, &frame, kInfinite, kInfinite};
	return compare(truth, frame, frame.pose);
}
}  // namespace

Match compare(const TimedPose& truth, const KeptFrame& frame, const mrpt::math::TPose2D& pose)
{
	return {
	    truth, &frame, std::hypot(pose.x - truth.pose.x, pose.y - truth.pose.y),
	    mrpt::RAD2DEG(std::abs(mrpt::math::wrapToPi(pose.phi - truth.pose.phi)))};
}

std::vector<Match> match(const std::vector<KeptFrame>& frames, const GroundTruth& truth)
{
	std::vector<const KeptFrame*> by_time;
	for (const auto& frame : frames) by_time.push_back(&frame);
	std::stable_sort(
	    by_time.begin(), by_time.end(),
	    [](const KeptFrame* a, const KeptFrame* b) { return a->timestamp < b->timestamp; });

	std::vector<Match> matches;
	for (const auto& line : truth)
	{
		const KeptFrame* nearest = nullptr;
		double least = kSameTime;
		for (auto it = std::lower_bound(
		         by_time.begin(), by_time.end(), line.timestamp - kSameTime,
		         [](const KeptFrame*frame, double time) { return frame->timestamp < time; });
		     it != by_time.end() && (*it)->timestamp <= line.timestamp + kSameTime; ++it)
		{
			const double difference = std::abs((*it)->timestamp - line.timestamp);
			if (difference >= least) continue;
			nearest = *it;
			least = difference;
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

MeanStd mean_std(const std::vector<double>& values)
{
	if (values.empty()) return {kNone, kNone};
	const double count = static_cast<double>(values.size());
	const double mean = std::accumulate(values.begin(), values.end(), 0.0) / count;
	double squares = 0;
	for (const double value : values) squares += (value - mean) * (value - mean);
	return {mean, std::sqrt(squares / count)};
}

double percentile(std::vector<double> values, double share)
{
	if (values.empty()) return kNone;
	const auto rank = std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())));
	std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rank), values.end());
	return values[rank];
}
}  // namespace d2s1r::app
