// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/accuracy.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <functional>
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
	    truth, &frame, std::hypot(pose.x - truth.robot.x, pose.y - truth.robot.y),
	    mrpt::RAD2DEG(std::abs(mrpt::math::wrapToPi(pose.phi - truth.robot.phi)))};
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
		         by_time.begin(), by_time.end(), line.time - kSameTime,
		         [](const KeptFrame*frame, double time) { return frame->timestamp < time; });
		     it != by_time.end() && (*it)->timestamp <= line.time + kSameTime; ++it)
		{
			const double difference = std::abs((*it)->timestamp - line.time);
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

namespace
{
using mrpt::math::TPose2D;

constexpr double kSamePosition = 0.15, kSameYaw = 4 * M_PI / 180;  //!< [m], [rad] of poses that differ by the same

/// Returns the angle [rad] from which the others differ least in the median, among some of them.
double middle_angle(const std::vector<TPose2D>& offsets)
{
	constexpr std::size_t kMostOffsets = 50;
	const std::size_t step = 1 + offsets.size() / kMostOffsets;
	double best = 0, least = HUGE_VAL;
	for (std::size_t i = 0; i < offsets.size(); i += step)
	{
		std::vector<double> off;
		for (const TPose2D& other : offsets) off.push_back(std::abs(mrpt::math::wrapToPi(other.phi - offsets[i].phi)));
		if (const double middle = percentile(off, 0.5); middle < least) least = middle, best = offsets[i].phi;
	}
	std::vector<double> around;
	for (const TPose2D& other : offsets) around.push_back(mrpt::math::wrapToPi(other.phi - best));
	return mrpt::math::wrapToPi(best + percentile(around, 0.5));
}

/// Returns the offset in the middle of others, and how many frames lie near what it makes of their true poses.
ConstantOffset middle_of(
    const std::vector<Match>& matches, bool is_in_map_frame,
    const std::function<TPose2D(const TPose2D& truth, const TPose2D& found)>& offset_of)
{
	std::vector<TPose2D> offsets;
	std::vector<double> xs, ys;
	for (const Match& match : matches) offsets.push_back(offset_of(match.truth.robot, match.frame->pose));
	ConstantOffset constant{is_in_map_frame, {}, 0, matches.size()};
	constant.offset.phi = middle_angle(offsets);
	for (std::size_t i = 0; i < matches.size(); i++)
	{
		const TPose2D &truth = matches[i].truth.robot, &found = matches[i].frame->pose;
		// The position belongs to the angle in the middle: in the map's frame it is far from the truth's own origin.
		const TPose2D turned = TPose2D(0, 0, constant.offset.phi) + truth;
		xs.push_back(is_in_map_frame ? found.x - turned.x : offsets[i].x);
		ys.push_back(is_in_map_frame ? found.y - turned.y : offsets[i].y);
	}
	constant.offset.x = percentile(xs, 0.5), constant.offset.y = percentile(ys, 0.5);
	for (const Match& match : matches)
	{
		const TPose2D &truth = match.truth.robot, &found = match.frame->pose;
		const TPose2D expected = is_in_map_frame ? constant.offset + truth : truth + constant.offset;
		constant.frames += std::hypot(found.x - expected.x, found.y - expected.y) < kSamePosition &&
		                   std::abs(mrpt::math::wrapToPi(found.phi - expected.phi)) < kSameYaw;
	}
	return constant;
}
}  // namespace

std::optional<ConstantOffset> find_constant_offset(const std::vector<Match>& matches)
{
	constexpr std::size_t kFewest = 8;  // [-] frames
	constexpr double kMostFrames = 0.7,
	                 kMoreFrames = 1.3;  // [-] share of the frames; times as many as without the offset
	std::vector<Match> localized;
	std::copy_if(
	    matches.begin(), matches.end(), std::back_inserter(localized),
	    [](const Match& match) { return match.frame->localized(); });
	if (localized.size() < kFewest) return std::nullopt;
	const ConstantOffset of_robot =
	    middle_of(localized, false, [](const TPose2D& truth, const TPose2D& found) { return found - truth; });
	const ConstantOffset of_map = middle_of(
	    localized, true,
	    [](const TPose2D& truth, const TPose2D& found)
	    { return TPose2D(0, 0, mrpt::math::wrapToPi(found.phi - truth.phi)); });
	const ConstantOffset& better = of_map.frames > of_robot.frames ? of_map : of_robot;
	const auto right = std::count_if(
	    localized.begin(), localized.end(),
	    [](const Match& match) {
		    return match.within({kSamePosition, kSameYaw * 180 / M_PI});
	    });
	const auto frames = static_cast<double>(better.frames);
	if (frames < kMostFrames * static_cast<double>(better.of) || frames < kMoreFrames * static_cast<double>(right))
		return std::nullopt;
	return better;
}
}  // namespace d2s1r::app
