// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "evaluation/accuracy.h"

using namespace d2s1r;
using namespace d2s1r::app;

namespace
{
KeptFrame frame_at(double time, double x, double phi, Status status = Status::kLocalized)
{
	KeptFrame frame;
	frame.timestamp = time;
	frame.status = status;
	frame.has_pose = true;
	frame.pose = {x, 0, phi};
	return frame;
}
}  // namespace

TEST(Statistics, MeanAndDeviationAreOfThePopulation)
{
	const MeanStd statistics = mean_std({1, 2, 3, 6});
	EXPECT_DOUBLE_EQ(statistics.mean, 3);
	EXPECT_DOUBLE_EQ(statistics.deviation, std::sqrt(14.0 / 4));
	EXPECT_TRUE(std::isnan(mean_std({}).mean));
	EXPECT_TRUE(std::isnan(mean_std({}).deviation));
}

TEST(Statistics, PercentilesAreValuesOfTheSample)
{
	const std::vector<double> values = {4, 1, 3, 2, 5, 10, 9, 8, 7, 6};
	EXPECT_EQ(percentile(values, 0), 1);
	EXPECT_EQ(percentile(values, 0.5), 6);
	EXPECT_EQ(percentile(values, 0.9), 10);
	EXPECT_EQ(percentile(values, 0.89), 9);
	EXPECT_EQ(percentile(values, 1), 10);
	EXPECT_EQ(percentile({7}, 0.99), 7);
	EXPECT_TRUE(std::isnan(percentile({}, 0.5)));
}

TEST(Accuracy, ALineCountsForTheNearestFrameWithinAMillisecond)
{
	const std::vector<KeptFrame> frames = {frame_at(10.0006, 1, 0), frame_at(10.0, 2, 0), frame_at(11.0, 3, 0)};
	const GroundTruth truth = {{10.0001, {}}, {10.0005, {}}, {11.0009, {}}, {11.0011, {}}, {9.0, {}}};
	const auto matches = match(frames, truth);
	ASSERT_EQ(matches.size(), 3U);
	EXPECT_EQ(matches[0].frame, &frames[1]);
	EXPECT_EQ(matches[1].frame, &frames[0]);
	EXPECT_EQ(matches[2].frame, &frames[2]);
	EXPECT_EQ(matches[2].truth.time, 11.0009);
}

TEST(Accuracy, YawErrorsGoTheShorterWayRound)
{
	const KeptFrame frame = frame_at(0, 0.3, M_PI - 0.01);
	const Match error = compare({0, {0, 0.4, -M_PI + 0.01}}, frame, frame.pose);
	EXPECT_NEAR(error.position_error, 0.5, 1e-12);
	EXPECT_NEAR(error.yaw_error, 0.02 * 180 / M_PI, 1e-9);
}

TEST(Accuracy, ErrorsAreOfTheSuccessesAndSuccessDoesNotDependOnTheStatus)
{
	std::vector<KeptFrame> frames = {
	    frame_at(1, 0.1, 0), frame_at(2, 0.2, 0, Status::kAmbiguous), frame_at(3, 5, 0), KeptFrame{}};
	frames[3].timestamp = 4;
	frames[3].status = Status::kRejected;
	const GroundTruth truth = {{1, {}}, {2, {}}, {3, {}}, {4, {}}};
	const auto matches = match(frames, truth);
	const Accuracy accuracy = measure(matches, {0.3, 5});
	EXPECT_EQ(accuracy.frames, 4U);
	EXPECT_EQ(accuracy.successes, 2U);
	EXPECT_EQ(accuracy.localized, 2U);
	EXPECT_EQ(accuracy.localized_successes, 1U);
	EXPECT_NEAR(accuracy.position_error.mean, 0.15, 1e-12);
	EXPECT_EQ(measure(matches, {0.2, 5}).successes, 1U);  // an error equal to the tolerance is too large
	EXPECT_TRUE(std::isinf(matches[3].position_error));
}
