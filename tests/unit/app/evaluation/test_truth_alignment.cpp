// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "evaluation/ground_truth.h"

using namespace d2s1r;
using namespace d2s1r::app;

namespace
{
/// The robot drives along a bow.
mrpt::math::TPose2D pose_at(double time)
{
	return {2 * std::sin(time / 2), time / 4, std::sin(time)};
}

/// Localized frames, 0.1 s apart.
std::vector<KeptFrame> frames_from(double start, int count)
{
	std::vector<KeptFrame> frames(static_cast<std::size_t>(count));
	for (std::size_t i = 0; i < frames.size(); i++)
	{
		frames[i].timestamp = start + 0.1 * static_cast<double>(i);
		frames[i].status = Status::kLocalized;
		frames[i].has_pose = true;
		frames[i].pose = pose_at(frames[i].timestamp);
	}
	return frames;
}

/// Lines every `step` seconds, by a clock that is ahead.
GroundTruth truth_every(double step, double start, double end, double ahead = 0)
{
	GroundTruth truth;
	for (double time = start; time <= end; time += step) truth.push_back({time + ahead, pose_at(time)});
	return truth;
}

/// Greatest distance between the lines and the way of the robot [m].
double greatest_error(const GroundTruth& lines)
{
	double greatest = 0;
	for (const auto& line : lines)
	{
		const auto pose = pose_at(line.time);
		greatest = std::max(greatest, std::hypot(pose.x - line.robot.x, pose.y - line.robot.y));
	}
	return greatest;
}
}  // namespace

TEST(TruthAlignment, LinesAtTheTimesOfFramesStayAsTheyAre)
{
	auto truth = truth_every(0.1, 100, 103);
	truth.push_back({50, {}});
	const AlignedTruth aligned = align_truth(truth, frames_from(100, 20));
	EXPECT_EQ(aligned.lines.size(), truth.size());
	EXPECT_EQ(aligned.interpolated, 0U);
	EXPECT_EQ(aligned.offset, 0);
}

TEST(TruthAlignment, FramesBetweenLinesGetAPoseBetweenTheirs)
{
	const AlignedTruth aligned = align_truth(truth_every(0.03, 100, 104), frames_from(100.015, 20));
	EXPECT_EQ(aligned.lines.size(), 20U);
	EXPECT_GE(aligned.interpolated, 18U);
	EXPECT_LT(greatest_error(aligned.lines), 0.01);
	EXPECT_EQ(aligned.offset, 0);
}

TEST(TruthAlignment, InterpolationGoesTheShorterWayRound)
{
	const auto frames = frames_from(100.1, 1);
	const AlignedTruth aligned = align_truth({{100, {0, 0, 3.1}}, {100.2, {0, 0, -3.1}}}, frames);
	ASSERT_EQ(aligned.lines.size(), 1U);
	EXPECT_NEAR(std::abs(aligned.lines[0].robot.phi), M_PI, 1e-6);
}

TEST(TruthAlignment, LinesTooFarApartAreNotJoined)
{
	const auto frames = frames_from(100.3, 1);
	EXPECT_EQ(align_truth({{100, {}}, {100.6, {}}}, frames).interpolated, 0U);
	EXPECT_EQ(align_truth({{100, {}}, {100.49, {}}}, frames).interpolated, 1U);
	EXPECT_EQ(align_truth({{100.31, {}}, {100.6, {}}}, frames).interpolated, 0U);
}

TEST(TruthAlignment, ConstantOffsetIsFound)
{
	for (const double ahead : {0.05, -0.73, 3.2})
	{
		const AlignedTruth aligned = align_truth(truth_every(0.1, 95, 120, ahead), frames_from(100, 120));
		EXPECT_NEAR(aligned.offset, ahead, 1e-3) << ahead;
		EXPECT_LT(greatest_error(aligned.lines), 0.01) << ahead;
	}
}

TEST(TruthAlignment, ARobotThatStandsShowsNoOffset)
{
	auto frames = frames_from(100, 40);
	auto truth = truth_every(0.1, 99, 106, 0.04);
	for (auto& frame : frames) frame.pose = {1, 2, 0.5};
	for (auto& line : truth) line.robot = {1.01, 2.02, 0.49};
	EXPECT_EQ(align_truth(truth, frames).offset, 0);
}

TEST(TruthAlignment, HeadingsInDegreesAreTold)
{
	const auto frames = frames_from(100, 60);
	GroundTruth truth = truth_every(0.1, 100, 106);
	EXPECT_FALSE(align_truth(truth, frames).is_in_degrees);
	for (auto& line : truth) line.robot.phi *= 180 / M_PI;
	EXPECT_TRUE(align_truth(truth, frames).is_in_degrees);
	GroundTruth unwrapped = truth_every(0.1, 100, 106);
	for (auto& line : unwrapped) line.robot.phi += 20 * M_PI;
	EXPECT_FALSE(align_truth(unwrapped, frames).is_in_degrees) << "ten turns further";
}
