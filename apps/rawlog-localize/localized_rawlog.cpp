// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "localized_rawlog.h"

#include "whole_file.h"

#include <d2s1r/pseudo_odometry.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <mrpt/poses/CPosePDFGaussian.h>
#include <mrpt/serialization/CArchive.h>

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

LocalizedRawlog::LocalizedRawlog(const std::string& path) : pending_(path)
{
	errno = 0;
	if (!stream_.open(pending_.temporary())) pending_.fail();
}

void LocalizedRawlog::add(const RawlogObject& object)
{
	if (stream_.Write(object.bytes.data(), object.bytes.size()) != object.bytes.size()) pending_.fail();
}

void LocalizedRawlog::add(const Frame& frame, const mrpt::obs::CObservation2DRangeScan& scan)
{
	if (!frame.localized()) return;
	if (last_)
		if (const auto motion = pseudo_odometry(*last_, frame.result))
			odometry_ = odometry_ + motion->poseChange->getMeanVal();
	last_ = frame.result;
	try
	{
		auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(stream_);
		archive << pose_observation(frame.result.best(), scan.timestamp);
		archive << odometry_observation(odometry_, scan.timestamp);
	}
	catch (const std::exception&)
	{
		pending_.fail();
	}
}

void LocalizedRawlog::commit()
{
	stream_.close();
	if (!is_whole_gzip(pending_.temporary())) pending_.fail();
	pending_.commit();
}
}  // namespace d2s1r::app
