// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/motion.h>
#include <gtest/gtest.h>

#include <cmath>

#include "fine/decision.h"
#include "frames/tracks.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
const WindowTuning kTuning;
const Reference kReference{5, 1};

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
	const Correction fit = best_correction(predicted(), {place(2.1, 5, 0.9)}, kReference, kTuning);
	EXPECT_GT(fit.pose.mean.x(), 2.08);
	EXPECT_LT(fit.pose.cov(0, 0), 0.01);
	EXPECT_NEAR(fit.evidence, 0, 1.0);
	EXPECT_EQ(fit.explained, 0.9);
}

TEST(TrackEvidence, ScanThatNoWallExplainsLeavesThePoseAlone)
{
	const Correction fit = best_correction(predicted(), {place(2.1, 30, 0.05)}, kReference, kTuning);
	EXPECT_EQ(fit.pose.mean.x(), 2);
	EXPECT_EQ(fit.pose.cov(0, 0), predicted().cov(0, 0));
	EXPECT_LE(fit.evidence, -2) << "unknown space explains anything, and is no evidence";
}

TEST(TrackEvidence, PoorlyExplainedScanPullsLess)
{
	const auto pulled = [](double explained)
	{ return best_correction(predicted(), {place(2.1, 5, explained)}, kReference, kTuning).pose.mean.x() - 2; };
	EXPECT_LT(pulled(0.2), pulled(0.9));
}

TEST(TrackEvidence, PlaceThatTheMotionCannotReachIsNotTaken)
{
	const Correction fit = best_correction(predicted(), {place(5, 5, 0.9), place(4, 9, 0.9)}, {9, 1}, kTuning);
	EXPECT_EQ(fit.pose.mean.x(), 2);
	EXPECT_EQ(fit.evidence, kNowhere);
	EXPECT_TRUE(missed(fit.evidence, kTuning));
}

TEST(TrackEvidence, OneShotHypothesisNearbyIsTakenIfItIsBetter)
{
	const Correction fit =
	    best_correction(predicted(), {place(2.1, -20, 0.3), place(1.9, 5, 0.9)}, kReference, kTuning);
	EXPECT_LT(fit.pose.mean.x(), 2);
	EXPECT_EQ(fit.explained, 0.9);
}

TEST(TrackEvidence, APlaceThatIsExactlyWhereATrackIsConfirmsNoOther)
{
	const auto track_at = [](double x, const std::string& map)
	{
		PlaceDensity track{predicted(), map};
		track.pose.mean.x(x);
		return track;
	};
	const std::vector<PlaceDensity> tracks = {track_at(2, ""), track_at(2.3, ""), track_at(2, "cellar")};
	const auto shared = shared_out({place(2, 5, 0.9), place(2.15, 4, 0.9)}, tracks, kTuning);
	ASSERT_EQ(shared.size(), 3U);
	ASSERT_EQ(shared[0].size(), 2U);
	ASSERT_EQ(shared[1].size(), 1U);
	EXPECT_EQ(shared[1][0].pose.x(), 2.15) << "between both tracks";
	EXPECT_TRUE(shared[2].empty()) << "in another map";
}

TEST(TrackEvidence, ATrackIsAtAPlaceThatIsItsPose)
{
	const auto is_at = [](double x) { return is_at_one(predicted(), {place(x, 5, 0.9)}, kTuning); };
	EXPECT_TRUE(is_at(2.02));
	EXPECT_FALSE(is_at(2.1)) << "one deviation";
	EXPECT_FALSE(is_at_one(predicted(), {}, kTuning));
}

TEST(TrackEvidence, UnknownSpaceSetsTheStandardOnlyWhereNothingElseIs)
{
	const std::vector<Hypothesis> places{place(1, 30, 0.01), place(2, -4, 0.8), place(3, -6, 0.9)};
	EXPECT_EQ(likeliest(places, kTuning), &places[1]);
	const std::vector<Hypothesis> hidden{place(1, 30, 0.01)};
	EXPECT_EQ(likeliest(hidden, kTuning), &hidden[0]);
	EXPECT_EQ(likeliest({}, kTuning), nullptr);
}

TEST(TrackEvidence, ABetterPlaceCountsAsIfTheScanHadFoundItAlone)
{
	const Grid grid = make_floor();
	Parameters parameters;
	parameters.scoring.rejected_below = 0;
	const Localizer localizer(make_map(grid), parameters);
	const PresenceModel& model = localizer.parameters().scoring.presence_model;
	const auto robot = poses_on_floor()[0];
	Scan scan = scan_at(world_of(grid), robot);
	for (std::size_t i = 0; i < 150; i++) block(scan, 103 * i, 1, 0.35F);  // people, gaps all around
	const Localization whole = localizer.localize(scan);
	const Localization elsewhere = localizer.localize(scan, {make_prior(robot.x + 1, -100, 100, 100)});
	ASSERT_FALSE(whole.hypotheses.empty());
	ASSERT_FALSE(elsewhere.hypotheses.empty());
	const auto absence_of = [&](const Localization& answer, const Hypothesis& best)
	{
		double listed = 0;
		for (const Hypothesis& hypothesis : answer.hypotheses) listed += hypothesis.probability;
		return absence(answer, listed, &best, model);
	};
	EXPECT_NEAR(absence_of(elsewhere, whole.best()), absence_of(whole, whole.best()), 0.7);
	EXPECT_GT(absence_of(elsewhere, elsewhere.best()), absence_of(whole, whole.best()) + 3);
}

TEST(TrackEvidence, APlaceThatUnknownSpaceMakesLikelySaysLittleOfThePresence)
{
	const PresenceModel model = ScoringParameters().presence_model;
	Localization alone;
	alone.hypotheses = {place(50, -16, 0.6), place(60, -20, 0.5)};
	alone.hypotheses[0].probability = 0.3;
	alone.hypotheses[1].probability = 0.1;
	for (Hypothesis& hypothesis : alone.hypotheses) hypothesis.log_odds = -1;
	Hypothesis hidden = place(2, -6, 0.3), seen = hidden;
	hidden.log_odds = -6;  // few walls are seen there
	seen.log_odds = 2;
	const double before = std::log(0.6 / 0.3);
	EXPECT_NEAR(absence(alone, 0.4, &alone.hypotheses[0], model), before, 1e-9);
	EXPECT_GT(absence(alone, 0.4, &hidden, model), before);
	EXPECT_LT(absence(alone, 0.4, &seen, model), before - 5);
}

TEST(TrackEvidence, SlippingWheelsAreNotRuledOut)
{
	const Correction fit =
	    best_correction(predicted(), {place(2.9, 5, 0.9)}, kReference, kTuning);  // nine deviations away
	EXPECT_GT(fit.evidence, -10);
	EXPECT_NEAR(fit.pose.mean.x(), 2.9, 1e-9) << "the scan says where, not an average";
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

TEST(TrackEvidence, IsDividedByTheTemperatureOfTheScan)
{
	const auto evidence = [](double explained, double log_likelihood, double temperature) {
		return evidence_of(place(0, log_likelihood, explained), {5, temperature}, kTuning);
	};
	EXPECT_NEAR(evidence(0.9, -3, 1), -8, 1e-9);
	EXPECT_NEAR(evidence(0.9, -3, 2), -4, 1e-9);
	EXPECT_EQ(evidence(0.9, 1000, 2), 0);
	EXPECT_EQ(evidence(0.01, 1000, 2), kTuning.hidden) << "explained by unknown space";
}

TEST(TrackEvidence, TheUsualErrorOfAMotionCostsNothing)
{
	const auto at = [](double x) { return best_correction(predicted(), {place(x, 5, 0.9)}, kReference, kTuning); };
	EXPECT_EQ(at(2.1).evidence, 0);
	EXPECT_LT(at(2.5).evidence, -1);
}
}  // namespace d2s1r::test
