// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/monitor.h>
#include <mrpt/math/TPose2D.h>

#include <map>
#include <optional>

namespace d2s1r::app
{
/// The poses that a tracker told: robot in map [m, rad] by time [s].
using TrackerPath = std::map<double, mrpt::math::TPose2D>;

/// What a scan says about the tracker that was running when the log was recorded.
struct CheckedTracker
{
	WatchedScan scan;
	std::optional<mrpt::math::TPose2D> pose{};  //!< of the tracker, robot in map, m and rad, when the scan was taken
};

/// Gives each scan of a log the pose of the tracker at its time, and the verdict of the monitor.
class TrackerCheck
{
   public:
	/// \throws std::invalid_argument if a setting is out of range
	TrackerCheck(TrackerPath path, const WatchSettings& settings) : path_(std::move(path)), monitor_(settings) {}

	/// Takes in the next scan; call it for every one that is localized.
	/// \param time [s] of the scan
	/// \param motion of the robot since the last call, in its frame then; no value: nobody measured it
	CheckedTracker add(
	    const Localizer& localizer, const Scan& scan, double time, const Localization& localization,
	    const std::optional<mrpt::poses::CPose2D>& motion);

   private:
	std::optional<mrpt::poses::CPose2D> pose_at(double time, const std::optional<mrpt::poses::CPose2D>& motion) const;
	std::optional<mrpt::poses::CPose2D> between_lines(double time) const;

	TrackerPath path_;
	TrackerMonitor monitor_;
	std::optional<double> last_time_;              //!< [s] of the last scan
	std::optional<mrpt::poses::CPose2D> tracker_;  //!< then
};
}  // namespace d2s1r::app
