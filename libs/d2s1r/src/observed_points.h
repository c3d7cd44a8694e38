// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/likelihood_field.h>

#include <memory>
#include <mutex>

namespace d2s1r
{
/// The end points of the last observation asked for: MRPT's filters pass the same observation for every particle.
/// Thread-safe.
class ObservedPoints
{
   public:
	using Points = std::shared_ptr<const std::vector<mrpt::math::TPoint2Df>>;

	/// \param most see end_points()
	ObservedPoints(const ScanParameters& parameters, int most);

	Points of(const mrpt::obs::CObservation2DRangeScan& observation);

   private:
	/// All of an observation that end points depend on.
	struct Key
	{
		std::vector<float> ranges;
		std::vector<char> valid;
		float aperture = 0, max_range = 0, delta_pitch = 0;
		bool right_to_left = true;
		mrpt::poses::CPose3D sensor_pose;
	};

	static Key key_of(const mrpt::obs::CObservation2DRangeScan& observation);
	static bool matches(const Key& key, const mrpt::obs::CObservation2DRangeScan& observation);

	ScanParameters parameters_;
	int most_;
	std::mutex mutex_;
	Key key_;
	Points points_;
};
}  // namespace d2s1r
