// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "observed_points.h"

#include <algorithm>
#include <cstring>

namespace d2s1r
{
ObservedPoints::ObservedPoints(const ScanParameters& parameters, int most) : parameters_(parameters), most_(most)
{
	parameters_.min_beams = 1;  // too few to localize with can still weigh poses
}

ObservedPoints::Key ObservedPoints::key_of(const mrpt::obs::CObservation2DRangeScan& observation)
{
	Key key{
	    {},
	    {},
	    observation.aperture,
	    observation.maxRange,
	    static_cast<float>(observation.deltaPitch),
	    observation.rightToLeft,
	    observation.sensorPose};
	for (std::size_t i = 0; i < observation.getScanSize(); i++)
	{
		key.ranges.push_back(observation.getScanRange(i));
		key.valid.push_back(observation.getScanRangeValidity(i) ? 1 : 0);
	}
	return key;
}

bool ObservedPoints::matches(const Key& key, const mrpt::obs::CObservation2DRangeScan& observation)
{
	const std::size_t n = observation.getScanSize();
	if (n != key.ranges.size() || observation.aperture != key.aperture || observation.maxRange != key.max_range ||
	    static_cast<float>(observation.deltaPitch) != key.delta_pitch || observation.rightToLeft != key.right_to_left ||
	    observation.sensorPose != key.sensor_pose)
		return false;
	if (n == 0) return true;
	// ranges are contiguous; bytes are compared because NaN ranges are equal, too
	if (std::memcmp(&observation.getScanRange(0), key.ranges.data(), n * sizeof(float)) != 0) return false;
	for (std::size_t i = 0; i < n; i++)
		if (observation.getScanRangeValidity(i) != (key.valid[i] != 0)) return false;
	return true;
}

ObservedPoints::Points ObservedPoints::of(const mrpt::obs::CObservation2DRangeScan& observation)
{
	const std::lock_guard<std::mutex> lock(mutex_);
	if (points_ && matches(key_, observation)) return points_;
	const Scan scan = make_scan(observation, parameters_);
	points_ = std::make_shared<std::vector<mrpt::math::TPoint2Df>>(
	    scan.valid() ? end_points(scan, most_) : std::vector<mrpt::math::TPoint2Df>{});
	key_ = key_of(observation);
	return points_;
}
}  // namespace d2s1r
