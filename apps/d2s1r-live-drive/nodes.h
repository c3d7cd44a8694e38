// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The nodes of a simulated robot, as peers of d2s1r-live.
#pragma once

#include <optional>
#include <string>

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
	std::string space;  //!< namespace of all topics; empty: the root
};

/// Says how the program was called, so that the tracker can be started as a process of its own. \param argv of main()
void set_words(char** argv);

/// Returns whether this process is the tracker of another one.
bool is_tracker();

/// Drives, and returns a line that says how it went. \throws std::exception, UserError
std::string drive(const DriveSettings& settings);

/// Is the robot's tracker, which knows no map: it follows the odometry from the last pose that it was told. It runs
/// until it is killed. \throws UserError
[[noreturn]] void track(const DriveSettings& settings);
}  // namespace d2s1r::drive
