// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/pseudo_odometry.h>
#include <mrpt/poses/CPosePDFGaussian.h>

#include <cmath>

namespace d2s1r
{
mrpt::obs::CActionRobotMovement2D motion_between(const Hypothesis& from, const Hypothesis& to)
{
	const mrpt::poses::CPosePDFGaussian start(from.pose, from.covariance);
	const mrpt::poses::CPosePDFGaussian end(to.pose, to.covariance);
	mrpt::poses::CPosePDFGaussian increment;
	increment.inverseComposition(end, start);

	mrpt::obs::CActionRobotMovement2D action;
	// emOdometry would be serialized without its covariance
	action.estimationMethod = mrpt::obs::CActionRobotMovement2D::emScan2DMatching;
	action.rawOdometryIncrementReading = increment.mean;
	action.poseChange = mrpt::poses::CPosePDFGaussian::Create(increment);
	// auxiliary particle filters draw from this model instead of poseChange
	auto& model = action.motionModelConfiguration;
	model.modelSelection = mrpt::obs::CActionRobotMovement2D::mmGaussian;
	const double std_xy = std::sqrt(std::max(increment.cov(0, 0), increment.cov(1, 1)));
	model.gaussianModel = {0, 0, 0, 0, std_xy, std::sqrt(increment.cov(2, 2))};
	return action;
}

std::optional<mrpt::obs::CActionRobotMovement2D> pseudo_odometry(const Localization& from, const Localization& to)
{
	if (from.hypotheses.empty() || to.hypotheses.empty()) return std::nullopt;
	return motion_between(from.best(), to.best());
}
}  // namespace d2s1r
