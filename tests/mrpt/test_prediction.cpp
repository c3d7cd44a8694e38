// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/motion.h>
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>

#include "made_hypotheses.h"
#include "prediction.h"

namespace d2s1r::test
{
namespace
{
using mrpt::poses::CPose2D;
using mrpt::poses::CPosePDFGaussian;
using pf::predict_motion;

const pf::Tuning kDefault;
const FilterParameters kFilter;

/// Two places that look alike, far apart, and where a robot may have gone from them.
const CPose2D kHere{1, 2, 0.3}, kThere{30, -4, 2.0};
const CPose2D kAhead{0.5, 0, 0.1}, kAside{0.3, 0.2, -0.2};

/// All weight of the filter is within a metre of `pose`.
pf::Support filter_at(const CPose2D& pose)
{
	return [pose](const Hypothesis& hypothesis) { return (hypothesis.pose - pose).norm() < 1 ? 1.0 : 0.0; };
}

std::optional<CPosePDFGaussian> choose(
    const Localization& from, const Localization& to, const CPose2D& filter,
    const std::optional<CPose2D>& odometry = {}, const CPose2D& previous = {})
{
	const CPosePDFGaussian predicted =
	    odometry ? odometry_motion(*odometry, kDefault.odometry) : predict_motion(previous, kFilter);
	return pf::choose_motion({from, to, predicted}, filter_at(filter), kDefault);
}

void expect_motion(const std::optional<CPosePDFGaussian>& motion, const CPose2D& expected, double tolerance = 0.02)
{
	ASSERT_TRUE(motion);
	EXPECT_NEAR(motion->mean.x(), expected.x(), tolerance);
	EXPECT_NEAR(motion->mean.y(), expected.y(), tolerance);
	EXPECT_NEAR(mrpt::math::wrapToPi(motion->mean.phi() - expected.phi()), 0, tolerance);
}

Localization at(const CPose2D& pose, double probability = 0.95)
{
	return result_of({hypothesis_at(pose, probability)});
}

TEST(PredictedMotion, GoesOnAsBeforeWithoutOdometryButMayChange)
{
	const auto motion = predict_motion(kAside, kFilter), odometry = odometry_motion(kAside, kDefault.odometry);
	expect_motion(motion, kAside, 1e-9);
	for (const int i : {0, 1, 2}) EXPECT_GT(motion.cov(i, i), 4 * odometry.cov(i, i)) << i;
}

TEST(ChosenMotion, OfAmbiguousFramesIsTheOneThatTheFilterSupports)
{
	const Localization from = result_of({hypothesis_at(kHere, 0.5), hypothesis_at(kThere, 0.45)});
	const Localization to = result_of({hypothesis_at(kThere + kAside, 0.6), hypothesis_at(kHere + kAhead, 0.35)});
	expect_motion(choose(from, to, kHere), kAhead);
	expect_motion(choose(from, to, kThere), kAside);
}

TEST(ChosenMotion, OfAmbiguousFramesIsTheMoreProbableOneIfTheFilterIsElsewhere)
{
	const Localization from = result_of({hypothesis_at(kHere, 0.5), hypothesis_at(kThere, 0.45)});
	const Localization to = result_of({hypothesis_at(kThere + kAside, 0.7), hypothesis_at(kHere + kAhead, 0.25)});
	expect_motion(choose(from, to, {-50, 0, 0}), kAside);
}

TEST(ChosenMotion, IsTheOneThatGoesOnAsBeforeIfNothingElseTellsTwoApart)
{
	const CPose2D back(-1.5, 0, 0);
	const Localization to = result_of({hypothesis_at(kHere + back, 0.5), hypothesis_at(kHere + kAhead, 0.45)});
	expect_motion(choose(at(kHere), to, kHere, {}, kAhead), kAhead);
	expect_motion(choose(at(kHere), to, kHere, {}, back), back);
}

TEST(ChosenMotion, DoesNotFollowAJumpToALookAlikePlace)
{
	EXPECT_FALSE(choose(at(kHere), at(kThere), kHere));
	EXPECT_FALSE(choose(at(kHere), at(kThere), kHere, kAhead));
	EXPECT_FALSE(choose(at(kHere), at(kHere + CPose2D(0, 0, M_PI)), kHere)) << "the room turned round";
}

TEST(ChosenMotion, IsThatOfTheImprobablePlaceIfTheBestOneIsAJump)
{
	const Localization to = result_of({hypothesis_at(kThere, 0.9), hypothesis_at(kHere + kAhead, 0.05)});
	expect_motion(choose(at(kHere), to, kHere), kAhead);
}

TEST(ChosenMotion, MayBeFarIfTheOdometryMeasuredIt)
{
	const CPose2D far(4, 0, 0.2);
	expect_motion(choose(at(kHere), at(kHere + far), kHere, far), far);
	EXPECT_FALSE(choose(at(kHere), at(kHere + far), kHere));
}

TEST(ChosenMotion, IsNoneIfAFrameWasRejected)
{
	EXPECT_FALSE(choose(result_of({}), at(kHere), kHere));
	EXPECT_FALSE(choose(at(kHere), result_of({}), kHere));
	EXPECT_FALSE(choose(result_of({}), result_of({}), kHere));
}

TEST(ChosenMotion, LiesBetweenOdometryAndLocalizationsThatAgree)
{
	const auto motion = choose(at(kHere), at(kHere + CPose2D(0.6, 0, 0)), kHere, CPose2D(0.5, 0, 0));
	ASSERT_TRUE(motion);
	EXPECT_GT(motion->mean.x(), 0.52);
	EXPECT_LT(motion->mean.x(), 0.58);
	EXPECT_LT(motion->cov(0, 0), odometry_motion(CPose2D(0.5, 0, 0), kDefault.odometry).cov(0, 0));
}

TEST(ChosenMotion, ThatTheOdometryDeniesTakesLocalizationsThatAreSure)
{
	const CPose2D slipped(0.5, 0, 0), moved(0.5, 1, 0);
	expect_motion(choose(at(kHere, 0.98), at(kHere + moved, 0.98), kHere, slipped), moved, 1e-9);
	EXPECT_FALSE(choose(at(kHere, 0.6), at(kHere + moved, 0.6), kHere, slipped));
}

TEST(ChosenMotion, IsTheOneThatTheOdometryMeasuredEvenIfItIsLessProbable)
{
	const Localization to =
	    result_of({hypothesis_at(kHere + CPose2D(-1, 0.8, 0), 0.9), hypothesis_at(kHere + kAhead, 0.05)});
	expect_motion(choose(at(kHere), to, kHere, kAhead), kAhead);
}

TEST(ChosenMotion, TurnsTheShortWayAcrossTheSeamOfTheYaw)
{
	expect_motion(choose(at({1, 2, 3.1}), at({1.2, 2, -3.1}), {1, 2, 3.1}), {-0.2, 0, 2 * M_PI - 6.2});
}

using Indices = std::vector<std::size_t>;

TEST(SystematicDraw, IsInProportionToTheWeights)
{
	EXPECT_EQ(pf::systematic_draw({0.25, 0.0, 0.75}, 4, 0.5), (Indices{0, 2, 2, 2}));
}

TEST(SystematicDraw, GivesMoreThanThereAre)
{
	EXPECT_EQ(pf::systematic_draw({0.5, 0.5}, 6, 0.5), (Indices{0, 0, 0, 1, 1, 1}));
}

TEST(SystematicDraw, SurvivesWeightsThatSumToLessThanOne)
{
	EXPECT_EQ(pf::systematic_draw({0.5, 0.4999999}, 1000, 0.9999999).back(), 1U);
}

mrpt::slam::CMonteCarloLocalization2D two_particles(double lighter, double heavier)
{
	mrpt::slam::CMonteCarloLocalization2D particles(2);
	particles.m_particles[0].d = {1, 2, 0};
	particles.m_particles[0].log_w = std::log(lighter);
	particles.m_particles[1].d = {5, 2, M_PI / 2};
	particles.m_particles[1].log_w = std::log(heavier);
	return particles;
}

TEST(ResizedParticles, ComeInProportionToTheirWeightsAndWeighTheSameThen)
{
	auto particles = two_particles(0.2, 0.8);
	pf::resize(particles, 10, 0.5);
	ASSERT_EQ(particles.size(), 10U);
	int of_heavier = 0;
	for (const auto& particle : particles.m_particles)
	{
		of_heavier += particle.d.x == 5 ? 1 : 0;
		EXPECT_EQ(particle.log_w, 0);
	}
	EXPECT_EQ(of_heavier, 8);
}

TEST(MovedParticles, MoveInTheirOwnFramesAndKeepTheirWeights)
{
	auto particles = two_particles(0.4, 0.6);
	pf::move_particles(particles, {kAhead, covariance_of(1e-6, 1e-6, 1e-6)});
	ASSERT_EQ(particles.size(), 2U);
	EXPECT_NEAR(particles.m_particles[0].d.x, 1.5, 1e-4);
	EXPECT_NEAR(particles.m_particles[1].d.y, 2.5, 1e-4);
	EXPECT_NEAR(particles.m_particles[1].d.phi, M_PI / 2 + 0.1, 1e-4);
	EXPECT_NEAR(std::exp(particles.m_particles[0].log_w - particles.m_particles[1].log_w), 0.4 / 0.6, 1e-9);
}
}  // namespace
}  // namespace d2s1r::test
