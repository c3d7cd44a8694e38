// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Dense>
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>

#include "frames/tracks.h"
#include "made_hypotheses.h"

namespace d2s1r::test
{
namespace
{
using mrpt::poses::CPose2D;

GuessedMotion common_motion(const std::vector<Hypothesis>& from, const std::vector<Hypothesis>& to)
{
	return d2s1r::common_motion(from, to, WindowTuning{});
}

void expect_pose(const CPose2D& pose, const CPose2D& expected, double tolerance = 1e-9)
{
	EXPECT_NEAR(pose.x(), expected.x(), tolerance);
	EXPECT_NEAR(pose.y(), expected.y(), tolerance);
	EXPECT_NEAR(mrpt::math::wrapToPi(pose.phi() - expected.phi()), 0, tolerance);
}

PoseDensity density(const CPose2D& mean, const std::vector<double>& deviations)
{
	return {mean, covariance_of(deviations.at(0), deviations.at(1), deviations.at(2))};
}

/// Where `motion` takes each of `starts`, as probable.
std::vector<Hypothesis> after(const std::vector<Hypothesis>& starts, const CPose2D& motion)
{
	std::vector<Hypothesis> ends = starts;
	for (Hypothesis& end : ends) end.pose = end.pose + motion;
	return ends;
}

const std::vector<Hypothesis> kThreePlaces = {
    hypothesis_at({1, 2, 0.3}, 0.4), hypothesis_at({9, -4, 3.1}, 0.3), hypothesis_at({-6, 3, -1.8}, 0.3)};
const CPose2D kStep = {0.4, 0.1, 0.3};

TEST(CommonMotion, IsTheOneThatMostHypothesesShare)
{
	expect_pose(common_motion(kThreePlaces, after(kThreePlaces, kStep)).motion.mean, kStep);
}

/// 40 of 1,600 pairs share the motion, and all others would be jumps.
TEST(CommonMotion, IsFoundAmongMorePairsThanAreCompared)
{
	std::vector<Hypothesis> places;
	for (int i = 0; i < 40; i++) places.push_back(hypothesis_at({10.0 * i, 0, 0.1 * i}, 1.0 / 40));
	const GuessedMotion guessed = common_motion(places, after(places, kStep));
	expect_pose(guessed.motion.mean, kStep);
	EXPECT_GT(guessed.probability, 0.6);
}

TEST(CommonMotion, OfTwoImprobablePlacesOutvotesThatOfOneProbablePlace)
{
	auto ends = after(kThreePlaces, kStep);
	ends[0].pose = kThreePlaces[0].pose + CPose2D(0.1, -0.4, -0.2);
	expect_pose(common_motion(kThreePlaces, ends).motion.mean, kStep);
}

TEST(CommonMotion, GoesByTheProbabilitiesOfBothEnds)
{
	const auto motion = [](double start, double other_start, double end, double other_end)
	{
		return common_motion(
		           {hypothesis_at({0, 0, 0}, start), hypothesis_at({9, 0, 0}, other_start)},
		           {hypothesis_at({0.4, 0, 0}, end), hypothesis_at({9, 0.4, 0}, other_end)})
		    .motion.mean;
	};
	expect_pose(motion(0.6, 0.3, 0.2, 0.7), {0, 0.4, 0});
	expect_pose(motion(0.9, 0.1, 0.4, 0.5), {0.4, 0, 0});
}

TEST(CommonMotion, TellsTurnsApart)
{
	// one way left, one way right, with the same step; two the other way straight on
	const std::vector<Hypothesis> starts = {
	    hypothesis_at({0, 0, 0}, 0.4), hypothesis_at({10, 0, 0}, 0.4), hypothesis_at({20, 0, 0}, 0.3),
	    hypothesis_at({30, 0, 0}, 0.3)};
	const std::vector<Hypothesis> ends = {
	    hypothesis_at({0.4, 0, 0.5}, 0.4), hypothesis_at({10.4, 0, -0.5}, 0.4), hypothesis_at({20, 0.4, 0}, 0.3),
	    hypothesis_at({30, 0.4, 0}, 0.3)};
	expect_pose(common_motion(starts, ends).motion.mean, {0, 0.4, 0});
}

TEST(CommonMotion, IsAsFarAsRobotsUsuallyGo)
{
	const std::vector<Hypothesis> start = {hypothesis_at({0, 0, 0}, 0.9)};
	const std::vector<Hypothesis> ends = {hypothesis_at({1.8, 0, 0}, 0.5), hypothesis_at({0, 0.3, 0}, 0.4)};
	expect_pose(common_motion(start, ends).motion.mean, {0, 0.3, 0});
}

/// The probability of the motion from one sure place to others.
double probability_of_motion_to(const std::vector<Hypothesis>& ends)
{
	return common_motion({hypothesis_at({0, 0, 0}, 1)}, ends).probability;
}

TEST(CommonMotion, IsProbableIfMostPairsOfHypothesesShareIt)
{
	EXPECT_GT(common_motion(kThreePlaces, after(kThreePlaces, kStep)).probability, 0.95);
	auto ends = after(kThreePlaces, kStep);
	ends[0].pose = kThreePlaces[0].pose + CPose2D(-0.4, 0, 0);
	const double probability = common_motion(kThreePlaces, ends).probability;
	EXPECT_GT(probability, 0.4);
	EXPECT_LT(probability, 0.6);
}

TEST(CommonMotion, IsTheLessProbableTheLessLikelyTheRobotIsAtAnyHypothesis)
{
	EXPECT_GT(probability_of_motion_to({hypothesis_at({0.3, 0, 0}, 0.6)}), 0.98);
	EXPECT_LT(probability_of_motion_to({hypothesis_at({0.3, 0, 0}, 0.02)}), 0.7);
}

TEST(CommonMotion, IsAJumpBetweenPlacesThatAreClearByThemselvesOnly)
{
	for (const CPose2D& jump : {CPose2D(2.5, 0, 0), CPose2D(30, 5, 2), CPose2D(0, 0, 1.2)})
	{
		EXPECT_NEAR(probability_of_motion_to({hypothesis_at(jump, 0.97)}), 0.97, 1e-9) << jump;
		EXPECT_NEAR(probability_of_motion_to({hypothesis_at(jump, 0.5)}), 0.5, 1e-9) << jump;
	}
	// A turn across the seam of the yaw is no jump.
	EXPECT_GT(common_motion({hypothesis_at({0, 0, 3}, 1)}, {hypothesis_at({0.1, 0, -3}, 0.5)}).probability, 0.9);
}

TEST(CommonMotion, IsNotKnownIfTwoOfThemAreAsUsual)
{
	EXPECT_LT(probability_of_motion_to({hypothesis_at({1.8, 0, 0}, 0.45), hypothesis_at({2.2, 0, 0}, 0.45)}), 0.9);
	EXPECT_LT(probability_of_motion_to({hypothesis_at({0.3, 0, 0}, 0.5), hypothesis_at({-0.3, 0, 0}, 0.5)}), 0.6);
}

TEST(CommonMotion, IsNotKnownIfAFrameHasNoHypothesis)
{
	EXPECT_EQ(common_motion({}, kThreePlaces).probability, 0);
	EXPECT_EQ(common_motion(kThreePlaces, {}).probability, 0);
	expect_pose(common_motion({}, {}).motion.mean, {0, 0, 0});
}

TEST(MovedPose, ComesBackByTheReversedMotion)
{
	const PoseDensity pose = density({3, -2, 3.0}, {0.1, 0.2, 0.05}), motion = density({0.7, 0.2, 0.5}, {0, 0, 0});
	const PoseDensity end = moved(pose, motion), back = moved(end, reversed(motion));
	expect_pose(end.mean, pose.mean + motion.mean);
	expect_pose(back.mean, pose.mean);
	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 3; c++) EXPECT_NEAR(back.cov(r, c), pose.cov(r, c), 1e-9) << r << ", " << c;
}

TEST(MovedPose, TakesTheUncertaintyOfTheMotionIntoTheMap)
{
	const PoseDensity sure = density({3, -2, M_PI / 2}, {0, 0, 0});
	const PoseDensity end = moved(sure, density({0.7, 0, 0.5}, {0.3, 0.1, 0.2}));
	const auto expected = covariance_of(0.1, 0.3, 0.2);
	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 3; c++) EXPECT_NEAR(end.cov(r, c), expected(r, c), 1e-9) << r << ", " << c;
}

/// How far the inverse of `motion` moves with each of x, y and phi, by finite differences.
Eigen::Matrix3d jacobian_of_inverse(const CPose2D& motion)
{
	constexpr double kDifference = 1e-6;
	Eigen::Matrix3d jacobian;
	for (int c = 0; c < 3; c++)
	{
		Eigen::Vector3d shifted(motion.x(), motion.y(), motion.phi());
		shifted[c] += kDifference;
		const CPose2D less = CPose2D() - motion, more = CPose2D() - CPose2D(shifted[0], shifted[1], shifted[2]);
		jacobian.col(c) << more.x() - less.x(), more.y() - less.y(), mrpt::math::wrapToPi(more.phi() - less.phi());
	}
	return jacobian / kDifference;
}

TEST(ReversedMotion, CarriesTheUncertaintyIntoTheFrameOfTheEnd)
{
	const PoseDensity motion = density({0.7, -0.2, 2.5}, {0.1, 0.02, 0.3});
	const PoseDensity back = reversed(motion);
	expect_pose(motion.mean + back.mean, {0, 0, 0});
	const Eigen::Matrix3d jacobian = jacobian_of_inverse(motion.mean);
	const Eigen::Matrix3d expected = jacobian * motion.cov.asEigen() * jacobian.transpose();
	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 3; c++) EXPECT_NEAR(back.cov(r, c), expected(r, c), 1e-5) << r << ", " << c;
}

}  // namespace
}  // namespace d2s1r::test
