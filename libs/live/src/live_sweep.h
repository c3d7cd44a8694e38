// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/sweep_guess.h>

#include <optional>
#include <string>
#include <vector>

#include "live/live_localizer.h"
#include "ros/wall_gain.h"

namespace d2s1r::live
{
/// Finds out when the beams of a running robot's laser are taken, if its messages do not tell that (time_increment 0).
/// Scans of the turning robot are localized with beams that were taken one after the other, and with beams that were
/// taken at once, until the walls of the map tell which is right. Until then they count as taken at once.
class LiveSweep
{
   public:
	/// \param given when beams are taken in any case; without a value, the messages or the map tell it
	explicit LiveSweep(const std::optional<ros::SweepTime>& given) : given_(given) {}

	/// Takes the next message of the laser.
	void add(const ros::LaserScan& scan);

	/// Returns when the beams of a message were taken.
	ros::SweepTime time_of(const ros::LaserScan& scan) const;

	/// Returns the sweeps that the map has to decide about; none if nothing is open.
	const std::vector<ros::SweepTime>& open() const { return open_; }

	/// Compares the answers to a scan of a turning robot. Other scans show nothing.
	/// \param at_once scan and answer with all beams taken at once
	/// \param sweeps by which the scan is read otherwise, one for each of open()
	void consider(
	    const Atlas& maps, Time time, const RangeScan& observation, const Scan& scan, const Localization& at_once,
	    const std::vector<Sweep>& sweeps);

	/// Says when beams are taken, and who says so; empty if no message has come.
	std::string description() const;

   private:
	void decide();

	std::optional<ros::SweepTime> given_, found_;
	ros::SweepGuess guess_;
	std::vector<ros::SweepTime> open_;
	std::vector<WallComparison> walls_;  //!< of each of these
	std::size_t messages_ = 0, tried_ = 0;
	Time last_tried_ = 0;
	bool is_told_ = false;     //!< whether a message has a time_increment
	bool is_at_once_ = false;  //!< whether the map shows that the beams are taken at once
};
}  // namespace d2s1r::live
