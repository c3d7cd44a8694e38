// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>
#include <logs/log.h>

#include <deque>
#include <optional>

namespace d2s1r::app
{
/// Where the robot was during the last seconds of a log, by its odometry. The increments of action collections have no
/// time of their own: each ends at the next scan.
class RobotMotion
{
   public:
	/// Takes in the odometry of an object of the log, in order.
	void add(const logs::RawlogObject& object);

	/// Says that a scan was taken at `time` [s since the epoch].
	void add_scan(double time);

	/// Returns whether the log has had any odometry with a time.
	bool is_known() const { return !poses_.empty(); }

	/// Returns whether the odometry is known up to a time [s since the epoch], or ended long before.
	bool covers(double time) const;

	/// Returns the poses around a sweep that goes from `first` to `last` [s after `stamp`], by the time after `stamp`
	/// [s since the epoch].
	std::vector<StampedPose> around(double stamp, double first, double last) const;

   private:
	void add(double time, const mrpt::poses::CPose2D& robot);

	std::deque<StampedPose> poses_;                        //!< by time [s since the epoch], in the odometry's frame
	std::optional<mrpt::poses::CPose2D> by_increments_;  //!< the sum of the increments; no value without any
	double newest_scan_ = 0;                             //!< [s since the epoch]
};
}  // namespace d2s1r::app
