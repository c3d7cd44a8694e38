// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>
#include <d2s1r/motion.h>
#include <d2s1r/scan_accumulator.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

namespace d2s1r
{
using mrpt::poses::CPosePDFGaussian;

namespace
{
constexpr double kMemory = 0.98;  //!< [0, 1] of what is known of the scale that a motion later still counts
}

CPosePDFGaussian increment_between(const Hypothesis& from, const Hypothesis& to)
{
	CPosePDFGaussian increment;
	increment.inverseComposition({to.pose, to.covariance}, {from.pose, from.covariance});
	return increment;
}

mrpt::math::CMatrixDouble33 covariance_of(double std_x, double std_y, double std_phi)
{
	mrpt::math::CMatrixDouble33 covariance;
	covariance.setDiagonal(std::vector<double>{std_x * std_x, std_y * std_y, std_phi * std_phi});
	return covariance;
}

CPosePDFGaussian odometry_motion(const mrpt::poses::CPose2D& increment, const OdometryTuning& tuning)
{
	const double way = increment.norm(), turn = std::abs(mrpt::math::wrapToPi(increment.phi()));
	const double std_xy = tuning.least_error + tuning.error_share * (way + turn);  // [m]
	const double std_phi = mrpt::DEG2RAD(tuning.least_turn) + tuning.error_share * turn +
	                       mrpt::DEG2RAD(tuning.turn_by_way) * way;  // [rad]
	return {increment, covariance_of(std_xy, std_xy, std_phi)};
}

double mahalanobis_distance(CPosePDFGaussian a, const CPosePDFGaussian& b)
{
	return a.mahalanobisDistanceTo(b);
}

CPosePDFGaussian combine(const CPosePDFGaussian& a, const CPosePDFGaussian& b)
{
	// MRPT's bayesianFusion() would average the yaws pi and -pi to 0
	const Eigen::Matrix3d cov_a = a.cov.asEigen();
	const Eigen::Matrix3d sum = cov_a + b.cov.asEigen();
	const Eigen::Matrix3d gain = sum.ldlt().solve(cov_a).transpose();
	const Eigen::Vector3d off(
	    b.mean.x() - a.mean.x(), b.mean.y() - a.mean.y(), mrpt::math::wrapToPi(b.mean.phi() - a.mean.phi()));
	const Eigen::Vector3d shift = gain * off;
	const Eigen::Matrix3d covariance = cov_a - gain * cov_a;
	return {
	    {a.mean.x() + shift.x(), a.mean.y() + shift.y(), mrpt::math::wrapToPi(a.mean.phi() + shift.z())},
	    mrpt::math::CMatrixDouble33(Eigen::Matrix3d(0.5 * (covariance + covariance.transpose())))};
}

/// Returns an increment with the estimated scale and errors.
CPosePDFGaussian OdometryCheck::corrected(const mrpt::poses::CPose2D& increment) const
{
	const double scale = estimate_.scale, way = increment.norm();
	CPosePDFGaussian motion = odometry_motion({scale * increment.x(), scale * increment.y(), increment.phi()}, tuning_);
	for (int i = 0; i < 2; i++)
		motion.cov(i, i) =
		    motion.cov(i, i) * mrpt::square(estimate_.way_noise) + mrpt::square(estimate_.scale_std * way);
	motion.cov(2, 2) *= mrpt::square(estimate_.turn_noise);
	return motion;
}

/// Compares an increment with the motion between two localized scans.
void OdometryCheck::learn(const mrpt::poses::CPose2D& increment, const CPosePDFGaussian& seen)
{
	constexpr double kTails = 5;  // [-] degrees of freedom of Student's t: wheels slip, and a scan may be wrong
	const double scale = estimate_.scale;
	const auto expected = odometry_motion({scale * increment.x(), scale * increment.y(), increment.phi()}, tuning_);
	const double distance = mahalanobis_distance(expected, seen);
	const double most = tuning_.most_disagreement / (2 * tuning_.newest);  // of one motion
	const auto average = [&](double& mean, double square) { mean += tuning_.newest * (std::min(square, most) - mean); };
	average(disagreement_, mrpt::square(distance));

	const double x = seen.mean.x() - expected.mean.x(), y = seen.mean.y() - expected.mean.y();
	const double turn = mrpt::math::wrapToPi(seen.mean.phi() - expected.mean.phi());
	const double of_way = expected.cov(0, 0) + 0.5 * (seen.cov(0, 0) + seen.cov(1, 1));  // [m2] variance
	const double off = (x * x + y * y) / of_way, off_turn = turn * turn / (expected.cov(2, 2) + seen.cov(2, 2));
	average(way_error_, off);
	average(turn_error_, off_turn);
	estimate_.way_noise = std::sqrt(std::max(1.0, way_error_ / 2));
	estimate_.turn_noise = std::sqrt(std::max(1.0, turn_error_));

	// A Kalman filter of the scale, whose measurement is the way.
	const double weight = (kTails + 2) / (kTails + off) / of_way;
	const double information = kMemory / mrpt::square(estimate_.scale_std) + weight * mrpt::square(increment.norm());
	estimate_.scale += weight * (x * increment.x() + y * increment.y()) / information;
	estimate_.scale_std = std::sqrt(1 / information);
	estimate_.motions++;
}

std::optional<CPosePDFGaussian> OdometryCheck::checked(
    const std::optional<mrpt::poses::CPose2D>& increment, const Localization& localization)
{
	const auto now = localization.status == Status::kLocalized ? std::optional(localization.best()) : std::nullopt;
	const bool is_usable = increment && is_plausible(*increment);
	if (before_ && now && is_usable && before_->map == now->map) learn(*increment, increment_between(*before_, *now));
	before_ = now;
	estimate_.is_relied_on = disagreement_ <= tuning_.most_disagreement;
	return increment ? motion(*increment) : std::nullopt;
}

std::optional<CPosePDFGaussian> OdometryCheck::motion(const mrpt::poses::CPose2D& increment) const
{
	if (!is_plausible(increment) || !estimate_.is_relied_on) return std::nullopt;
	return corrected(increment);
}
}  // namespace d2s1r
