// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/localizer.h>
#include <d2s1r/motion.h>
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>
#include <mrpt/poses/CPosePDFGaussian.h>
#include <mrpt/poses/CPosePDFGaussianInf.h>
#include <mrpt/poses/CPosePDFGrid.h>
#include <mrpt/poses/CPosePDFParticles.h>
#include <mrpt/poses/CPosePDFSOG.h>

#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;

TEST(PriorOfCorners, HoldsTheBoxInAnyOrderOfTheCorners)
{
	const Prior prior = make_prior(3, 5, -1, 2);
	EXPECT_TRUE(prior.allows({0, 3, 3.1}));
	EXPECT_TRUE(prior.allows({-1, 2, 0}));
	EXPECT_FALSE(prior.allows({3.1, 3, 0}));
	EXPECT_FALSE(prior.allows({0, 5.1, 0}));
	EXPECT_TRUE(prior.allows({3.1, 3, 0}, 0.2));
	EXPECT_TRUE(Prior{}.allows({1e6, 1e6, 0}));
}

TEST(PriorOfCorners, MayBeAsFarAsNumbersGo)
{
	const Prior prior = make_prior(-1e308, -1e308, 1e308, 5);
	EXPECT_TRUE(prior.allows({100, 4, 1}));
	EXPECT_FALSE(prior.allows({100, 6, 1}));
}

TEST(PriorOfCorners, RefusesEmptyAndInfiniteBoxes)
{
	EXPECT_THROW(make_prior(1, 1, 1, 2), std::invalid_argument);
	EXPECT_THROW(make_prior(0, 0, INFINITY, 2), std::invalid_argument);
	EXPECT_THROW(make_prior(0, 0, NAN, 2), std::invalid_argument);
}

TEST(PriorOfDensity, HoldsThreeDeviationsOfAGaussianAcrossTheSeamOfTheYaw)
{
	const mrpt::poses::CPosePDFGaussian gaussian({2, 1, 3.1}, covariance_of(0.2, 1, 0.1));
	const Prior prior = make_prior(gaussian);
	EXPECT_TRUE(prior.allows({2.8, 1, 3.1}));
	EXPECT_FALSE(prior.allows({3.0, 1, 3.1}));
	EXPECT_TRUE(prior.allows({2, 4.2, 3.1}));
	EXPECT_TRUE(prior.allows({2, 1, -3.0}));
	EXPECT_FALSE(prior.allows({2, 1, 2.0}));
}

TEST(PriorOfDensity, HoldsTheModesOfASumAndTheGaussianOfAnythingElse)
{
	mrpt::poses::CPosePDFSOG sum(2);
	sum.get(0).mean = mrpt::poses::CPose2D(0, 0, 0);
	sum.get(1).mean = mrpt::poses::CPose2D(10, 0, 0);
	sum.get(0).cov = sum.get(1).cov = covariance_of(0.1, 0.1, 0.1);
	const Prior of_sum = make_prior(sum);
	EXPECT_TRUE(of_sum.allows({0, 0, 0}));
	EXPECT_TRUE(of_sum.allows({10, 0, 0}));
	EXPECT_FALSE(of_sum.allows({5, 0, 0}));
	EXPECT_THROW(make_prior(mrpt::poses::CPosePDFSOG(0)), std::invalid_argument);

	const mrpt::poses::CPosePDFGaussianInf inverse(mrpt::poses::CPose2D(1, 1, 0), covariance_of(10, 10, 10));
	EXPECT_TRUE(make_prior(inverse).allows({1.5, 1, 0}));
	EXPECT_FALSE(make_prior(inverse).allows({1.7, 1, 0}));
}

TEST(PriorOfDensity, HoldsTheLikelyCellsOfAGrid)
{
	mrpt::poses::CPosePDFGrid grid(0, 10, -5, 5, 0.2, mrpt::DEG2RAD(10.0));
	grid.uniformDistribution();
	const Prior anywhere = make_prior(grid);
	for (const mrpt::math::TPose2D& pose : {TPose2D{0.1, -4.9, 3}, TPose2D{9.9, 4.9, 0}, TPose2D{5, 0, -1}})
		EXPECT_TRUE(anywhere.allows(pose)) << pose;
	for (unsigned x = 0; x < grid.getSizeX(); x++)
		for (unsigned y = 0; y < grid.getSizeY(); y++)
			for (unsigned phi = 0; phi < grid.getSizePhi(); phi++) *grid.getByIndex(x, y, phi) = 0;
	*grid.getByPos(2, 1, 0.5) = 1;
	*grid.getByPos(8, -3, -2) = 0.5;
	const Prior two = make_prior(grid);
	EXPECT_TRUE(two.allows({2, 1, 0.5}));
	EXPECT_TRUE(two.allows({8, -3, -2}));
	EXPECT_FALSE(two.allows({5, -1, -0.7}));
	EXPECT_FALSE(two.allows({2, 1, -2}));
}

TEST(PriorOfDensity, HoldsTheCellsOfAGridNotOnlyTheirCentres)
{
	mrpt::poses::CPosePDFGrid grid(0, 10, -6, 6, 2.0, M_PI);
	grid.uniformDistribution();
	const Prior prior = make_prior(grid);
	for (const double x : {0.5, 1.1, 5.0, 5.9})
		for (const double phi : {-2.5, -M_PI / 2, -0.7, 1.0, M_PI / 2})
			EXPECT_TRUE(prior.allows({x, 1, phi})) << x << phi;
	EXPECT_FALSE(prior.allows({12.5, 1, 0}));
}

TEST(PriorOfDensity, LeavesOutWhatTheGridAllButRulesOut)
{
	mrpt::poses::CPosePDFGrid grid(0, 10, -5, 5, 0.5, mrpt::DEG2RAD(30.0));
	grid.uniformDistribution();
	*grid.getByPos(2, 1, 0.5) = 1e4 * *grid.getByPos(8, -3, -2);
	const Prior prior = make_prior(grid);
	EXPECT_TRUE(prior.allows({2, 1, 0.5}));
	EXPECT_FALSE(prior.allows({8, -3, -2}));
}

TEST(PriorOfDensity, RefusesVariancesThatAreNoNumber)
{
	EXPECT_THROW(
	    make_prior(mrpt::poses::CPosePDFGaussian({0, 0, 0}, covariance_of(std::nan(""), 1, 1))), std::invalid_argument);
	auto negative = covariance_of(1, 1, 1);
	negative(1, 1) = -1;
	EXPECT_THROW(make_prior(mrpt::poses::CPosePDFGaussian({0, 0, 0}, negative)), std::invalid_argument);
}

TEST(PriorOfDensity, RefusesWeightsThatAreNoNumber)
{
	for (const double weight : {std::nan(""), HUGE_VAL})
	{
		mrpt::poses::CPosePDFSOG sum(2);
		for (std::size_t i = 0; i < 2; i++) sum.get(i).cov = covariance_of(1, 1, 1);
		sum.get(1).log_w = -HUGE_VAL;  // it weighs nothing
		EXPECT_NO_THROW(make_prior(sum));
		sum.get(1).log_w = weight;
		EXPECT_THROW(make_prior(sum), std::invalid_argument) << weight;
		mrpt::poses::CPosePDFParticles particles(3);
		EXPECT_NO_THROW(make_prior(particles));
		particles.m_particles[2].log_w = weight;
		EXPECT_THROW(make_prior(particles), std::invalid_argument) << weight;
		mrpt::poses::CPosePDFGrid grid(0, 2, 0, 2, 0.5, mrpt::DEG2RAD(30.0));
		grid.uniformDistribution();
		EXPECT_NO_THROW(make_prior(grid));
		*grid.getByPos(1, 1, 0.5) = weight;
		EXPECT_THROW(make_prior(grid), std::invalid_argument) << weight;
	}
}

TEST(PriorOfDensity, HoldsAllParticlesInABoundedNumberOfBoxes)
{
	mrpt::poses::CPosePDFParticles particles(20000);
	std::mt19937 generator(7);
	std::uniform_real_distribution<double> x(0, 200), y(0, 30), phi(-M_PI, M_PI);
	for (auto& particle : particles.m_particles) particle.d = {x(generator), y(generator), phi(generator)};
	const Prior prior = make_prior(particles);
	EXPECT_LE(prior.boxes.size(), 256U);
	for (const auto& particle : particles.m_particles) ASSERT_TRUE(prior.allows(particle.d));
	EXPECT_FALSE(prior.allows({-30, 10, 0}));
	EXPECT_THROW(make_prior(mrpt::poses::CPosePDFParticles(0)), std::invalid_argument);
}

TEST(PriorOfCorners, TheMarginsWidenTheBoxAndTheYaw)
{
	PoseBox box{0, 1, 0, 1, 3.1, 0.2};
	EXPECT_FALSE(box.contains({0.5, 0.5, 3.1 + 0.3}));
	EXPECT_TRUE(box.contains({0.5, 0.5, 3.1 + 0.3}, 0, 0.15));
	EXPECT_FALSE(box.contains({0.5, 0.5, 3.1 + 0.3}, 0.15, 0));
	EXPECT_TRUE(Prior{{box}}.allows({1.1, 0.5, 3.1 - 0.3}, 0.15, 0.15));
}

TEST(PriorOfDensity, IsWiderThanTheDensity)
{
	const mrpt::poses::CPosePDFGaussian exact({2, 1, 0.5}, covariance_of(0, 0, 0));
	mrpt::poses::CPosePDFParticles particles(1);
	particles.m_particles[0].d = {2, 1, 0.5};
	for (const Prior& prior : {make_prior(exact), make_prior(particles)})
	{
		for (const double off : {-0.29, 0.29})
		{
			EXPECT_TRUE(prior.allows({2 + off, 1, 0.5})) << off;
			EXPECT_TRUE(prior.allows({2, 1 + off, 0.5})) << off;
			EXPECT_TRUE(prior.allows({2, 1, 0.5 + 0.59 * off})) << off;
		}
		EXPECT_FALSE(prior.allows({2.9, 1, 0.5}));
		EXPECT_FALSE(prior.allows({2, 1, 1.3}));
	}
}

TEST(PriorOfDensity, RefusesParticlesThatAreNowhere)
{
	for (const TPose2D& nowhere : {TPose2D{std::nan(""), 0, 0}, TPose2D{0, INFINITY, 0}, TPose2D{0, 0, std::nan("")}})
	{
		mrpt::poses::CPosePDFParticles particles(2);
		particles.m_particles[0].d = {1, 1, 1};
		particles.m_particles[1].d = nowhere;
		EXPECT_THROW(make_prior(particles), std::invalid_argument) << nowhere;
	}
}

/// Two rooms that are alike.
class LocalizeWithPrior : public testing::Test
{
   protected:
	const Grid grid_ = make_picture_grid(
	    enlarge(
	        {"####################",  //
	         "#........##........#",  //
	         "#........##........#",  //
	         "####.....######....#",  //
	         "#........##........#",  //
	         "#....##..##....##..#",  //
	         "####################"},
	        10),
	    0.05);
	const Localizer localizer_{make_map(grid_), Parameters{}};
	const TPose2D left_{1.3, 2.2, 0.7}, right_{6.3, 2.2, 0.7};
};

void expect_at(const Localization& result, const TPose2D& truth)
{
	ASSERT_FALSE(result.hypotheses.empty()) << result.note;
	EXPECT_LT(std::hypot(result.best().pose.x() - truth.x, result.best().pose.y() - truth.y), 0.1);
	EXPECT_LT(std::abs(mrpt::math::wrapToPi(result.best().pose.phi() - truth.phi)), 0.05);
}

TEST_F(LocalizeWithPrior, TellsTwinRoomsApart)
{
	Laser laser;
	laser.on_robot = mrpt::poses::CPose3D(0.2, 0.1, 0, 1.0, 0, 0);
	const auto scan = make_observation(grid_, left_, laser);
	const Prior in_left = make_prior(0, 0, 4.9, 4), in_right = make_prior(5.1, 0, 10, 4);
	expect_at(localizer_.localize(scan, {in_left}), left_);
	for (const Hypothesis& hypothesis : localizer_.localize(scan, {in_right}).hypotheses)
		EXPECT_TRUE(in_right.allows(hypothesis.pose.asTPose())) << hypothesis.pose;
}

TEST_F(LocalizeWithPrior, FindsARobotInABoxSmallerThanTheSpacingOfTheSamples)
{
	const Prior tight = make_prior(left_.x - 0.05, left_.y - 0.05, left_.x + 0.05, left_.y + 0.05);
	expect_at(localizer_.localize(make_observation(grid_, left_), {tight}), left_);
}

TEST_F(LocalizeWithPrior, RejectsAScanFromOutsideOfTheRegion)
{
	const auto scan = make_observation(grid_, left_);
	const Localization nowhere = localizer_.localize(scan, {make_prior(100, 100, 110, 110)});
	EXPECT_EQ(nowhere.status, Status::kRejected);
	EXPECT_EQ(nowhere.note, "no place in the given region explains the scan");
}

TEST_F(LocalizeWithPrior, RespectsTheYaw)
{
	const auto scan = make_observation(grid_, left_);
	const auto facing = [&](double turn)
	{
		const mrpt::poses::CPosePDFGaussian there({left_.x, left_.y, left_.phi + turn}, covariance_of(0.1, 0.1, 0.1));
		return localizer_.localize(scan, {make_prior(there)});
	};
	expect_at(facing(0.1), left_);
	const Localization backwards = facing(M_PI);
	EXPECT_EQ(backwards.status, Status::kRejected) << backwards.confidence;
	for (const Hypothesis& hypothesis : backwards.hypotheses)
		EXPECT_GT(std::abs(mrpt::math::wrapToPi(hypothesis.pose.phi() - left_.phi)), M_PI / 2);
}

TEST_F(LocalizeWithPrior, IsOfTheRobotHoweverFarTheSensorIsFromIt)
{
	Laser laser;
	laser.on_robot = mrpt::poses::CPose3D(1.2, 0, 0, 2.0, 0, 0);
	const TPose2D robot{1.3, 2.2, -0.6};  // its sensor is 1 m to the right
	const auto scan = make_observation(grid_, robot, laser);
	const Prior here = make_prior(robot.x - 0.1, robot.y - 0.1, robot.x + 0.1, robot.y + 0.1);
	expect_at(localizer_.localize(scan, {here}), robot);
	const mrpt::poses::CPosePDFGaussian as_it_stands(mrpt::poses::CPose2D(robot), covariance_of(0.1, 0.1, 0.05));
	expect_at(localizer_.localize(scan, {make_prior(as_it_stands)}), robot);
	const TPose2D sensor = robot + TPose2D{1.2, 0, 0};
	const Prior where_the_sensor_is = make_prior(sensor.x - 0.1, sensor.y - 0.1, sensor.x + 0.1, sensor.y + 0.1);
	EXPECT_NE(localizer_.localize(scan, {where_the_sensor_is}).status, Status::kLocalized);
}

TEST_F(LocalizeWithPrior, ThePaperMethodRefusesAPrior)
{
	Parameters parameters;
	parameters.method = Method::kPaper;
	const Localizer paper(make_map(grid_), parameters);
	EXPECT_THROW(paper.localize(make_observation(grid_, left_), {make_prior(0, 0, 1, 1)}), std::invalid_argument);
}

TEST_F(LocalizeWithPrior, AnyTimeBudgetStillGivesAPose)
{
	const auto scan = make_observation(grid_, {3.2, 1.4, -2}, {});
	for (const double budget : {1e-6, 1.0, 1e6})
	{
		const Localization result = localizer_.localize(scan, {Prior{}, budget});
		EXPECT_FALSE(result.hypotheses.empty()) << budget << " ms: " << result.note;
	}
	const Localization plenty = localizer_.localize(scan, {Prior{}, 1e6}), unlimited = localizer_.localize(scan);
	EXPECT_EQ(plenty.best().pose, unlimited.best().pose);
	EXPECT_EQ(plenty.confidence, unlimited.confidence);
}

TEST_F(LocalizeWithPrior, RefusesATimeBudgetThatIsNone)
{
	for (const double budget : {-1.0, std::nan("")})
		EXPECT_THROW(localizer_.localize(make_observation(grid_, left_), {Prior{}, budget}), std::invalid_argument);
}
}  // namespace
}  // namespace d2s1r::test
