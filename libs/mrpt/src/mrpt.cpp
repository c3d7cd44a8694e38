// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/motion.h>
#include <d2s1r/mrpt.h>

#include <algorithm>
#include <cmath>

namespace d2s1r
{
using mrpt::poses::CPosePDFGaussian;

RangeScan scan_of(const mrpt::obs::CObservation2DRangeScan& observation)
{
	RangeScan scan;
	const std::size_t beams = observation.getScanSize();
	scan.ranges.reserve(beams);
	scan.valid.reserve(beams);
	for (std::size_t i = 0; i < beams; i++)
	{
		scan.ranges.push_back(observation.getScanRange(i));
		scan.valid.push_back(observation.getScanRangeValidity(i) ? 1 : 0);
	}
	scan.aperture = observation.aperture;
	scan.right_to_left = observation.rightToLeft;
	scan.max_range = observation.maxRange;
	scan.delta_pitch = observation.deltaPitch;
	scan.sensor_on_robot = observation.sensorPose;
	return scan;
}

mrpt::obs::CObservation2DRangeScan observation_of(const RangeScan& scan, mrpt::obs::CObservation2DRangeScan like)
{
	like.resizeScan(scan.size());
	for (std::size_t i = 0; i < scan.size(); i++)
	{
		like.setScanRange(i, scan.ranges[i]);
		like.setScanRangeValidity(i, scan.is_valid(i));
	}
	like.aperture = scan.aperture;
	like.rightToLeft = scan.right_to_left;
	like.maxRange = scan.max_range;
	like.deltaPitch = scan.delta_pitch;
	like.sensorPose = scan.sensor_on_robot;
	return like;
}

std::optional<mrpt::obs::CActionRobotMovement2D> pseudo_odometry(const Localization& from, const Localization& to)
{
	if (from.hypotheses.empty() || to.hypotheses.empty() || from.best().map != to.best().map) return std::nullopt;
	const CPosePDFGaussian increment = increment_between(from.best(), to.best());
	mrpt::obs::CActionRobotMovement2D action;
	// MRPT would serialize emOdometry without its covariance
	action.estimationMethod = mrpt::obs::CActionRobotMovement2D::emScan2DMatching;
	action.rawOdometryIncrementReading = increment.mean;
	action.poseChange = CPosePDFGaussian::Create(increment);
	// auxiliary particle filters draw from this model instead of poseChange
	auto& model = action.motionModelConfiguration;
	model.modelSelection = mrpt::obs::CActionRobotMovement2D::mmGaussian;
	const double std_xy = std::sqrt(std::max(increment.cov(0, 0), increment.cov(1, 1)));
	model.gaussianModel = {0, 0, 0, 0, std_xy, std::sqrt(increment.cov(2, 2))};
	return action;
}
}  // namespace d2s1r
