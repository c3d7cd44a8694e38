// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/mrpt.h>
#include <gtest/gtest.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/serialization/CArchive.h>

#include "made_hypotheses.h"

namespace d2s1r::test
{
namespace
{
using mrpt::poses::CPose2D;

TEST(PseudoOdometry, IsTheMotionInTheFrameOfTheFirstPose)
{
	const auto motion = pseudo_odometry(localized_at({1, 2, M_PI / 2}), localized_at({1, 3, M_PI}));
	ASSERT_TRUE(motion);
	const CPose2D mean = motion->poseChange->getMeanVal();
	EXPECT_NEAR(mean.x(), 1.0, 1e-9);
	EXPECT_NEAR(mean.y(), 0.0, 1e-9);
	EXPECT_NEAR(mean.phi(), M_PI / 2, 1e-9);
	EXPECT_NEAR((motion->rawOdometryIncrementReading - mean).norm(), 0.0, 1e-9);
}

TEST(PseudoOdometry, TurnsAcrossPlusMinusPiTheShortWay)
{
	const auto motion = pseudo_odometry(localized_at({0, 0, 3.1}), localized_at({0, 0, -3.1}));
	EXPECT_NEAR(motion->poseChange->getMeanVal().phi(), 2 * M_PI - 6.2, 1e-9);
}

TEST(PseudoOdometry, NeedsAPoseAtBothEnds)
{
	EXPECT_FALSE(pseudo_odometry(Localization{}, localized_at({1, 1, 0})));
	EXPECT_FALSE(pseudo_odometry(localized_at({1, 1, 0}), Localization{}));
}

TEST(PseudoOdometry, KeepsItsCovarianceInARawlog)
{
	const auto motion = pseudo_odometry(localized_at({0, 0, 0}), localized_at({1, 0, 0.2}));
	mrpt::io::CMemoryStream stream;
	mrpt::serialization::archiveFrom(stream) << *motion;
	stream.Seek(0);
	mrpt::obs::CActionRobotMovement2D read;
	mrpt::serialization::archiveFrom(stream) >> read;
	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 3; c++)
			EXPECT_NEAR(read.poseChange->getCovariance()(r, c), motion->poseChange->getCovariance()(r, c), 1e-6);
}

TEST(PseudoOdometry, ModelForAuxiliaryFiltersIsNoNarrowerThanTheCovariance)
{
	auto motion = *pseudo_odometry(localized_at({0, 0, 0}), localized_at({1, 0, 0.2}));
	const auto covariance = motion.poseChange->getCovariance();
	motion.computeFromOdometry(motion.rawOdometryIncrementReading, motion.motionModelConfiguration);
	for (int i = 0; i < 3; i++) EXPECT_GE(motion.poseChange->getCovariance()(i, i), covariance(i, i) * (1 - 1e-6));
}
}  // namespace
}  // namespace d2s1r::test
