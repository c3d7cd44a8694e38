// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/motion.h>
#include <gtest/gtest.h>
#include <mrpt/core/bits_math.h>

#include <cmath>
#include <random>

#include "made_hypotheses.h"

namespace d2s1r::test
{
namespace
{
using mrpt::poses::CPose2D;
}  // namespace

TEST(OdometryCheck, DistrustsOdometryThatScansContradictUntilTheyAgreeAgain)
{
	OdometryCheck check;
	CPose2D robot;
	const CPose2D step(0.5, 0, 0.1);
	const auto agrees = [&](const std::optional<CPose2D>& odometry)
	{
		robot = robot + step;
		return check.checked(odometry, localized_at(robot)).has_value();
	};
	for (int i = 0; i < 10; i++) EXPECT_TRUE(agrees(step)) << i;
	EXPECT_TRUE(agrees(CPose2D(0.4, 0.05, 0.15)));
	int believed = 0;
	while (agrees(CPose2D())) ASSERT_LT(believed++, 5) << "frozen";
	int distrusted = 0;
	while (!agrees(step)) ASSERT_LT(distrusted++, 10) << "repaired";
}

TEST(OdometryCheck, OneWrongMotionIsForgiven)
{
	OdometryCheck check;
	CPose2D robot;
	const CPose2D step(0.5, 0, 0.1);
	for (int i = 0; i < 5; i++) EXPECT_TRUE(check.checked(step, localized_at(robot = robot + step)));
	EXPECT_TRUE(check.checked(step, localized_at(robot = robot + CPose2D(20, 5, 2)))) << "one outlier";
	for (int i = 0; i < 5; i++) EXPECT_TRUE(check.checked(step, localized_at(robot = robot + step))) << i;
}

TEST(OdometryCheck, LearnsNothingFromScansThatAreNotLocalizedOrOdometryThatIsNotUsable)
{
	OdometryCheck check;
	Localization unsure = localized_at({});
	unsure.status = Status::kAmbiguous;
	for (int i = 0; i < 20; i++)
	{
		EXPECT_TRUE(check.checked(CPose2D(3, 0, 0), unsure));
		EXPECT_TRUE(check.checked(CPose2D(3, 0, 0), localized_at({})));  // no motion seen since the scan before
		EXPECT_FALSE(check.checked({}, localized_at({5, 5, 1})));
		EXPECT_FALSE(check.checked(CPose2D(std::nan(""), 0, 0), localized_at({})));
	}
	EXPECT_TRUE(check.checked(CPose2D(3, 0, 0), localized_at({3, 0, 0})));
}

TEST(OdometryCheck, EstimatesTheScaleAndCorrectsIncrements)
{
	for (const double too_long : {0.6, 0.8, 1.0, 1.3, 1.7})
	{
		OdometryCheck check;
		CPose2D robot;
		std::optional<mrpt::poses::CPosePDFGaussian> motion;
		for (int i = 0; i < 60; i++)
		{
			const CPose2D step(0.3 + 0.1 * (i % 3), 0, 0.05 * (i % 5 - 2));
			motion = check.checked(CPose2D(too_long * step.x(), 0, step.phi()), localized_at(robot = robot + step));
		}
		const OdometryEstimate& told = check.estimate();
		EXPECT_EQ(told.motions, 59U);
		EXPECT_NEAR(told.scale, 1 / too_long, 0.03) << too_long;
		EXPECT_LT(told.scale_std, 0.07) << too_long;
		EXPECT_LT(std::abs(told.scale - 1 / too_long), 3 * told.scale_std + 0.005) << too_long;
		ASSERT_TRUE(motion && told.is_relied_on) << too_long;
		EXPECT_NEAR(motion->mean.x(), 0.3 + 0.1 * (59 % 3), 0.02) << too_long;
	}
}

TEST(OdometryCheck, EstimatesTheErrorsOfTurns)
{
	std::mt19937 generator(1);
	std::normal_distribution<double> error(0, mrpt::DEG2RAD(12.0));
	OdometryCheck exact, shaken;
	CPose2D robot;
	const CPose2D step(0.3, 0, 0);
	std::optional<mrpt::poses::CPosePDFGaussian> of_exact, of_shaken;
	for (int i = 0; i < 60; i++)
	{
		const Localization scan = localized_at(robot = robot + step);
		of_exact = exact.checked(step, scan);
		of_shaken = shaken.checked(CPose2D(0.3, 0, error(generator)), scan);
	}
	EXPECT_LT(exact.estimate().turn_noise, 1.2);
	EXPECT_GT(shaken.estimate().turn_noise, 2);
	ASSERT_TRUE(of_exact);
	EXPECT_TRUE(!of_shaken || of_shaken->cov(2, 2) > 4 * of_exact->cov(2, 2));
}
}  // namespace d2s1r::test
