// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/sweep_guess.h>
#include <ros/sweep_trial.h>

#include <optional>
#include <string>
#include <vector>

#include "live/live_localizer.h"

namespace d2s1r::live
{
/// Finds out when the beams of a running robot's laser are taken, if its messages do not tell that (time_increment 0),
/// or are clouds whose points may have been moved to one time before. Scans of the turning robot are localized in both
/// ways until the walls of the map tell which is right; until then the messages are believed.
class LiveSweep
{
   public:
	/// \param given when beams are taken in any case; without a value, the messages or the map tell it
	explicit LiveSweep(const std::optional<ros::SweepTime>& given) : given_(given) {}

	/// Takes the next message of the laser.
	void add(const ros::LaserScan& scan);
	void add(const ros::PointCloud& cloud);

	/// Returns when the beams of a message were taken. \param of_message what it says
	ros::SweepTime time_of(const ros::SweepTime& of_message) const;

	/// Returns the sweeps that may be right in place of what the messages say; none if nothing is open.
	const std::vector<ros::SweepTime>& open() const { return open_; }

	/// Compares the answers to a scan of a turning robot. Other scans show nothing.
	/// \param usual when its beams were taken by the messages, scan and answer with that
	/// \param others by which the scan is read otherwise, one for each of open()
	void consider(
	    const Atlas& maps, Time time, const PlacedObservation& usual, const Scan& scan, const Localization& answer,
	    const std::vector<Sweep>& others);

	/// Says when beams are taken, and who says so; empty if no message has come.
	std::string description() const;

   private:
	std::optional<ros::SweepTime> given_, found_;
	ros::SweepGuess guess_;
	std::vector<ros::SweepTime> open_;
	ros::SweepTrial trial_;
	std::size_t messages_ = 0;
	bool has_clouds_ = false;
	bool is_told_ = false;  //!< whether a message tells the times of its beams
};
}  // namespace d2s1r::live
