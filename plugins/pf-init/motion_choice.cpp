// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "motion_choice.h"

#include <d2s1r/pseudo_odometry.h>
#include <mrpt/math/wrap2pi.h>

#include <Eigen/Dense>
#include <cmath>

namespace d2s1r::pf
{
namespace
{
using mrpt::poses::CPosePDFGaussian;

Eigen::Vector3d difference(const mrpt::poses::CPose2D& a, const mrpt::poses::CPose2D& b)
{
	return {a.x() - b.x(), a.y() - b.y(), mrpt::math::wrapToPi(a.phi() - b.phi())};
}

mrpt::math::CMatrixDouble33 diagonal(double std_x, double std_y, double std_phi)
{
	mrpt::math::CMatrixDouble33 covariance;
	covariance.setZero();
	covariance(0, 0) = std_x * std_x;
	covariance(1, 1) = std_y * std_y;
	covariance(2, 2) = std_phi * std_phi;
	return covariance;
}

CPosePDFGaussian increment_between(const Hypothesis& from, const Hypothesis& to, const MotionParameters& parameters)
{
	const auto action = motion_between(from, to);
	CPosePDFGaussian increment;
	increment.copyFrom(*action.poseChange);
	increment.cov += diagonal(parameters.pseudo_xy, parameters.pseudo_xy, parameters.pseudo_phi);
	return increment;
}

bool is_jump(const mrpt::poses::CPose2D& increment, const MotionParameters& parameters)
{
	return increment.norm() > parameters.farthest || std::abs(increment.phi()) > parameters.widest_turn;
}
}  // namespace

CPosePDFGaussian predict_motion(
    const std::optional<mrpt::poses::CPose2D>& odometry, const mrpt::poses::CPose2D& previous,
    const MotionParameters& parameters)
{
	if (!odometry)
		return CPosePDFGaussian(
		    previous, diagonal(parameters.unknown_along, parameters.unknown_across, parameters.unknown_phi));
	const double distance = odometry->norm(), turn = std::abs(odometry->phi());
	const double std_xy = parameters.odometry_xy + parameters.odometry_xy_per_m * distance;
	const double std_phi =
	    parameters.odometry_phi + parameters.odometry_phi_per_rad * turn + parameters.odometry_phi_per_m * distance;
	return CPosePDFGaussian(*odometry, diagonal(std_xy, std_xy, std_phi));
}

std::optional<CPosePDFGaussian> choose_motion(
    const MotionEvidence& evidence, const Support& support, const MotionParameters& parameters)
{
	const CPosePDFGaussian& predicted = evidence.predicted;
	std::optional<CPosePDFGaussian> best;
	double best_score = parameters.least_score;  // [nat] higher is better
	const double surprise = evidence.is_measured ? parameters.odometry_surprise : parameters.surprise;
	for (const Hypothesis& from : evidence.previous.hypotheses)
	{
		const double of_start = std::log(from.probability * (parameters.least_support + support(from)) + 1e-12);
		for (const Hypothesis& to : evidence.current.hypotheses)
		{
			const CPosePDFGaussian increment = increment_between(from, to, parameters);
			const Eigen::Matrix3d spread = (predicted.cov + increment.cov).asEigen();
			const Eigen::Vector3d error = difference(increment.mean, predicted.mean);
			const double squared = error.dot(spread.ldlt().solve(error));
			const bool is_surprise = squared > parameters.gate * parameters.gate;
			if (is_surprise && is_jump(increment.mean, parameters)) continue;
			const double score = of_start + std::log(to.probability + 1e-12) - std::min(0.5 * squared, surprise);
			if (score <= best_score) continue;
			best_score = score;
			best = is_surprise ? increment : combine(predicted, increment);
		}
	}
	return best;
}
}  // namespace d2s1r::pf
