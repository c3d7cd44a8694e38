// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/motion.h>
#include <gtest/gtest.h>

#include "frames/tracks.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
const WindowTuning kTuning;

/// 0.1 m and 0.05 rad unsure.
PoseDensity predicted()
{
	PoseDensity density;
	density.mean = {2, 1, 0.5};
	density.cov.setDiagonal(std::vector<double>{0.01, 0.01, 0.0025});
	return density;
}

Hypothesis place(double x, double log_likelihood, double explained)
{
	Hypothesis hypothesis;
	hypothesis.pose = {x, 1, 0.5};
	hypothesis.covariance.setDiagonal(std::vector<double>{1e-4, 1e-4, 1e-4});
	hypothesis.log_likelihood = log_likelihood;
	hypothesis.explained = explained;
	return hypothesis;
}
}  // namespace

TEST(TrackEvidence, ScanCorrectsThePose)
{
	const Correction fit = best_correction(predicted(), place(2.1, 5, 0.9), {}, 5, kTuning);
	EXPECT_GT(fit.pose.mean.x(), 2.08);
	EXPECT_LT(fit.pose.cov(0, 0), 0.01);
	EXPECT_NEAR(fit.evidence.log_likelihood, 0, 1.0);
	EXPECT_EQ(fit.evidence.explained, 0.9);
}

TEST(TrackEvidence, ScanThatNoWallExplainsLeavesThePoseAlone)
{
	const Correction fit = best_correction(predicted(), place(2.1, 30, 0.05), {}, 5, kTuning);
	EXPECT_EQ(fit.pose.mean.x(), 2);
	EXPECT_EQ(fit.pose.cov(0, 0), predicted().cov(0, 0));
	EXPECT_LE(fit.evidence.log_likelihood, -2) << "unknown space explains anything, and is no evidence";
}

TEST(TrackEvidence, PoorlyExplainedScanPullsLess)
{
	const auto pulled = [](double explained)
	{ return best_correction(predicted(), place(2.1, 5, explained), {}, 5, kTuning).pose.mean.x() - 2; };
	EXPECT_LT(pulled(0.2), pulled(0.9));
}

TEST(TrackEvidence, PlaceThatTheMotionCannotReachIsNotTaken)
{
	const Correction fit = best_correction(predicted(), place(5, 5, 0.9), {place(4, 9, 0.9)}, 9, kTuning);
	EXPECT_EQ(fit.pose.mean.x(), 2);
	EXPECT_EQ(fit.evidence.log_likelihood, kTuning.least_evidence);
	EXPECT_TRUE(missed(fit.evidence, kTuning));
}

TEST(TrackEvidence, OneShotHypothesisNearbyIsTakenIfItIsBetter)
{
	const Correction fit = best_correction(predicted(), place(2.1, -20, 0.3), {place(1.9, 5, 0.9)}, 5, kTuning);
	EXPECT_LT(fit.pose.mean.x(), 2);
	EXPECT_EQ(fit.evidence.explained, 0.9);
}

TEST(TrackEvidence, UnknownSpaceSetsTheStandardOnlyWhereNothingElseIs)
{
	EXPECT_EQ(
	    greatest_likelihood({place(1, 30, 0.01), std::nullopt}, {place(2, -4, 0.8), place(3, -6, 0.9)}, kTuning), -4);
	EXPECT_EQ(greatest_likelihood({place(1, 30, 0.01)}, {}, kTuning), 30);
}

TEST(TrackEvidence, OnlyTheLastTenFramesSayWhatIsExplained)
{
	Track track;
	for (int i = 0; i < 40; i++) track.evidence.push_back({0, i < 30 ? 1.0 : 0.2, 0});
	EXPECT_NEAR(explained_by(track), 0.2, 1e-12);
	track.evidence.resize(5);
	EXPECT_NEAR(explained_by(track), 1, 1e-12);
}

TEST(TrackEvidence, SlippingWheelsAreNotRuledOut)
{
	const Correction fit = best_correction(predicted(), place(3.0, 5, 0.9), {}, 5, kTuning);  // ten deviations away
	EXPECT_GT(fit.evidence.log_likelihood, -9);
	EXPECT_NEAR(fit.pose.mean.x(), 3, 1e-9) << "the scan says where, not an average";
}

TEST(TrackEvidence, OfAScanThatHardlyFitsOtherYawsAreTried)
{
	const Grid grid = make_floor();
	const Localizer localizer(make_map(grid), {});
	const auto robot = poses_on_floor()[0];
	Scan scan = scan_at(world_of(grid), robot);
	for (std::size_t i = 0; i < 300; i++) block(scan, 103 * i, 1, 0.35F);  // people, gaps all around
	const mrpt::poses::CPose2D turned(robot.x, robot.y, robot.phi + 20 * kDegree);
	const auto found =
	    refined_near(localizer, scan, PoseDensity(turned, covariance_of(0.05, 0.05, 10 * kDegree)), kTuning);
	ASSERT_TRUE(found);
	EXPECT_LT(distance_between(found->pose.asTPose(), robot), 0.1);
	EXPECT_LT(turn_between(found->pose.asTPose(), robot), 1);
}

TEST(TrackEvidence, IsBounded)
{
	const auto log_likelihood = [](double explained, double relative)
	{ return evidence_of(place(0, 0, explained), relative, kTuning).log_likelihood; };
	EXPECT_NEAR(log_likelihood(0.9, -1000), kTuning.least_evidence, 1e-6);
	EXPECT_NEAR(log_likelihood(0.9, 0), 0, 1e-3);
	EXPECT_NEAR(log_likelihood(0.9, 1000), 0, 1e-3);
	EXPECT_EQ(log_likelihood(0.01, 1000), kTuning.least_evidence / 2);  // explained by unknown space
}
}  // namespace d2s1r::test
