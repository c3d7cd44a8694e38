// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Dense>
#include <d2s1r/motion.h>
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>
#include <mrpt/poses/CPosePDFGaussian.h>

#include <random>

#include "made_hypotheses.h"

namespace d2s1r::test
{
namespace
{
using mrpt::poses::CPose2D;
using mrpt::poses::CPosePDFGaussian;

TEST(IncrementBetween, CarriesTheUncertaintyOfBothEnds)
{
	const Hypothesis from = hypothesis_at({1, 2, 0.7}, 0.9, {0.10, 0.02, 0.04});
	const Hypothesis to = hypothesis_at({4, 1, -0.4}, 0.9, {0.05, 0.20, 0.03});
	const auto covariance = increment_between(from, to).cov;

	std::mt19937 generator(1);
	std::normal_distribution<double> normal;
	const auto draw = [&](const Hypothesis& h)
	{
		return CPose2D(
		    h.pose.x() + std::sqrt(h.covariance(0, 0)) * normal(generator),
		    h.pose.y() + std::sqrt(h.covariance(1, 1)) * normal(generator),
		    h.pose.phi() + std::sqrt(h.covariance(2, 2)) * normal(generator));
	};
	const CPose2D mean = to.pose - from.pose;
	mrpt::math::CMatrixDouble33 sampled;
	sampled.setZero();
	constexpr int kSamples = 100000;
	for (int i = 0; i < kSamples; i++)
	{
		const CPose2D increment = draw(to) - draw(from);
		const double error[3] = {
		    increment.x() - mean.x(), increment.y() - mean.y(), mrpt::math::wrapToPi(increment.phi() - mean.phi())};
		for (int r = 0; r < 3; r++)
			for (int c = 0; c < 3; c++) sampled(r, c) += error[r] * error[c] / kSamples;
	}
	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 3; c++) EXPECT_NEAR(covariance(r, c), sampled(r, c), 1.5e-3) << r << ", " << c;
}

/// The product of Gaussians by their information matrices; differences from the mean of `a` are small.
void expect_product(const CPosePDFGaussian& a, const CPosePDFGaussian& b)
{
	const Eigen::Matrix3d of_a = a.cov.asEigen().inverse(), of_b = b.cov.asEigen().inverse();
	const Eigen::Matrix3d covariance = (of_a + of_b).inverse();
	const Eigen::Vector3d difference(
	    b.mean.x() - a.mean.x(), b.mean.y() - a.mean.y(), mrpt::math::wrapToPi(b.mean.phi() - a.mean.phi()));
	const Eigen::Vector3d shift = covariance * of_b * difference;
	const auto product = combine(a, b);
	EXPECT_NEAR(product.mean.x(), a.mean.x() + shift[0], 1e-9);
	EXPECT_NEAR(product.mean.y(), a.mean.y() + shift[1], 1e-9);
	EXPECT_NEAR(mrpt::math::wrapToPi(product.mean.phi() - a.mean.phi() - shift[2]), 0, 1e-9);
	EXPECT_LE(std::abs(product.mean.phi()), M_PI);
	EXPECT_TRUE(product.cov.asEigen().isApprox(covariance, 1e-9)) << product.cov;
}

TEST(OdometryMotion, IsLessCertainTheFurtherAndTheMoreItTurns)
{
	const CPosePDFGaussian none = odometry_motion({0, 0, 0}), ahead = odometry_motion({1, 0, 0}),
	                       turn = odometry_motion({0, 0, -1});
	EXPECT_GT(none.cov(0, 0), 0);
	for (const int i : {0, 2})
	{
		EXPECT_GT(ahead.cov(i, i), none.cov(i, i)) << i;
		EXPECT_GT(turn.cov(i, i), none.cov(i, i)) << i;
	}
	EXPECT_EQ(turn.mean, CPose2D(0, 0, -1));
}

TEST(MahalanobisDistance, IsInStandardDeviationsOfTheDifference)
{
	const CPosePDFGaussian a({1, 2, 3.1}, covariance_of(0.3, 3, 0.03));
	EXPECT_NEAR(mahalanobis_distance(a, {{2, 2, 3.1}, covariance_of(0.4, 4, 0.04)}), 2, 1e-9);
	EXPECT_NEAR(mahalanobis_distance(a, {{1, 7, 3.1}, covariance_of(0.4, 4, 0.04)}), 1, 1e-9);
	EXPECT_NEAR(mahalanobis_distance(a, {{1, 2, -3.1}, covariance_of(0.4, 4, 0.04)}), (2 * M_PI - 6.2) / 0.05, 1e-6);
}

TEST(CombinedEstimates, IsTheProductOfTwoGaussians)
{
	CPosePDFGaussian a({1, 2, 0.4}, covariance_of(0.1, 0.2, 0.1)), b({1.3, 1.8, 0.5}, covariance_of(0.3, 0.1, 0.2));
	a.cov(0, 1) = a.cov(1, 0) = 0.015;
	b.cov(1, 2) = b.cov(2, 1) = -0.01;
	expect_product(a, b);
	expect_product(b, a);
}

TEST(CombinedEstimates, IsTheProductAcrossTheSeamOfTheYaw)
{
	const CPosePDFGaussian a({0, 0, 3.0}, covariance_of(0.1, 0.1, 0.1)), b({0, 0, -3.0}, covariance_of(0.1, 0.1, 0.05));
	expect_product(a, b);
	expect_product(b, a);
	EXPECT_NEAR(combine(a, b).mean.phi(), -3.0 - 0.2 * (2 * M_PI - 6), 1e-9);
}
}  // namespace
}  // namespace d2s1r::test
