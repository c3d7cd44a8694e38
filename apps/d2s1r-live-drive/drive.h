// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// How a simulated robot drives, and how d2s1r-live and its tracker do meanwhile.
#pragma once

#include <cstdint>
#include <string>

#include "ros_arguments.h"
#include "world.h"

namespace d2s1r::drive
{
struct DriveSettings
{
	std::string map;
	double seconds = 30;
	std::string markers;      //!< file for the markers with the most hypotheses; empty: none
	std::string log;          //!< file for where the robot and its tracker were at each scan; empty: none
	std::string tracker;      //!< command of the shell that is the tracker; empty: track()
	bool leaves_map = false;  //!< to somebody else's /map
	WorldSettings world;
	double scan_rate = 10, odometry_rate = 50;  //!< [Hz]
	double scan_time = 0;                       //!< [s] that the scans tell, though all beams are taken at once
	double between_kidnappings = 60;            //!< [s]; 0: there is none
	double between_crashes = 0;                 //!< [s] of the tracker; 0: there is none
	double until_return = 2;                    //!< [s] that a tracker takes to come back
	std::uint32_t domain = 0;
	live::Names names;  //!< of all topics
};

/// Drives, and returns a line that says how it went. \throws std::exception, UserError
std::string drive(const DriveSettings& settings);
}  // namespace d2s1r::drive
