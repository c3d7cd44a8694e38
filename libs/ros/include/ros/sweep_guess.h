// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "ros/observation.h"

namespace d2s1r::ros
{
/// Guesses when the beams of a laser were taken whose messages have a time_increment of 0 (drivers write that for
/// spinning lasers, and simulators for lasers that take all beams at once), a negative one, or one that sweep_time_of()
/// does not take.
class SweepGuess
{
   public:
	/// Takes the next message of the laser.
	void add(const LaserScan& scan);

	/// Returns whether the messages suggest that the laser spins: by a scan_time, or a time_increment that is none.
	bool is_suggested() const { return is_wrong_ || !scan_times_.empty(); }

	/// Returns the sweeps of a laser that needs scan_time [s, or ms], or the time from one scan to the next, for a full
	/// turn, or 0.1 or 0.2 s if neither can be, or of one whose first or last beam was first if time_increment is
	/// negative.
	std::vector<SweepTime> sweeps() const;

   private:
	bool is_told_ = false;                      //!< whether a message has a time_increment of a sweep
	bool is_wrong_ = false;                     //!< whether a message has a time_increment that is none of a sweep
	double backwards_ = 0;                      //!< [s] that a message tells if its time_increment is negative
	double share_of_turn_ = 0;                  //!< [-] that the beams cover
	std::int64_t last_time_ = 0;                //!< [ns] of a message
	std::vector<double> scan_times_, periods_;  //!< [s] of the first messages
};
}  // namespace d2s1r::ros
