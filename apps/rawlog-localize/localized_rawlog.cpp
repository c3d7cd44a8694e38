// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "localized_rawlog.h"

#include <d2s1r/pseudo_odometry.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <mrpt/poses/CPosePDFGaussian.h>

namespace d2s1r::app
{
namespace
{
mrpt::obs::CObservationRobotPose pose_observation(const Hypothesis& best, mrpt::Clock::time_point time)
{
	mrpt::obs::CObservationRobotPose observation;
	observation.timestamp = time;
	observation.sensorLabel = "D2S1R";
	observation.pose.copyFrom(mrpt::poses::CPosePDFGaussian(best.pose, best.covariance));
	return observation;
}

mrpt::obs::CObservationOdometry odometry_observation(const mrpt::poses::CPose2D& pose, mrpt::Clock::time_point time)
{
	mrpt::obs::CObservationOdometry observation;
	observation.timestamp = time;
	observation.sensorLabel = kPseudoOdometryLabel;
	observation.odometry = pose;
	return observation;
}
}  // namespace

void LocalizedRawlog::add(const Frame& frame, const mrpt::obs::CObservation2DRangeScan& scan)
{
	if (!frame.localized()) return;
	if (last_)
		if (const auto motion = pseudo_odometry(*last_, frame.result))
			odometry_ = odometry_ + motion->poseChange->getMeanVal();
	last_ = frame.result;
	file_.write(pose_observation(frame.result.best(), scan.timestamp));
	file_.write(odometry_observation(odometry_, scan.timestamp));
}
}  // namespace d2s1r::app
