// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPose2D.h>

#include <deque>
#include <optional>
#include <utility>
#include <vector>

namespace d2s1r::ros
{
/// Holds a time [s] since the epoch and a pose [m, rad] at that time.
using TimedReading = std::pair<double, mrpt::math::TPose2D>;

/// Holds the last thousand readings of a robot's odometry. Not thread-safe.
class OdometryTrack
{
   public:
	/// Takes a reading, unless it is not later than the last one. If it is before all others, the clock was set back:
	/// they are forgotten.
	void add(const TimedReading& reading);

	/// Returns the readings from one time [s] to another, the last two before these, by which the motion is
	/// extrapolated, and the first after them, as far as they are known.
	std::vector<TimedReading> over(double start, double end) const;

	/// Returns the pose at a time [s], between two readings; no value before the first and after the last one.
	std::optional<mrpt::math::TPose2D> at(double time) const;

	/// Returns the time [s] of the last reading; no value if there is none.
	std::optional<double> newest() const;

	/// Forgets all readings.
	void clear() { readings_.clear(); }

   private:
	std::deque<TimedReading> readings_;  //!< by increasing time
};
}  // namespace d2s1r::ros
