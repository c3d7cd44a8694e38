// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/motion.h>
#include <gtest/gtest.h>

#include <cmath>

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
}  // namespace d2s1r::test
