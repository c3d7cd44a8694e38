// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A small flat, and logs of a robot in it.
#pragma once

#include <mrpt/serialization/CSerializable.h>

#include <string>
#include <vector>

#include "test_maps.h"

namespace d2s1r::test
{
/// 10 m x 8 m, no two places alike.
const Grid& flat();

/// Robot poses of a walk through it, map frame, 0.4 s apart from kStartTime on.
const std::vector<mrpt::math::TPose2D>& walk();
inline constexpr double kStartTime = 1600000000.0;  //!< [s] since the epoch
double walk_time(std::size_t i);                    //!< [s] since the epoch

/// What the laser `label` (a full turn, on the robot at x = 0.1 m) sees at walk()[i].
mrpt::obs::CObservation2DRangeScan::Ptr walk_scan(std::size_t i, const std::string& label = "LASER");

using Objects = std::vector<mrpt::serialization::CSerializable::Ptr>;
Objects observation_log();    //!< one observation a pose
Objects action_log();         //!< an action collection and a sensory frame a pose
Objects covered_laser_log();  //!< like observation_log(), but pose 3 sees nothing and pose 4 has a tilted sensor
void save(const Objects& objects, const std::string& rawlog);
Objects load(const std::string& rawlog);
std::vector<std::uint8_t> bytes_of(const mrpt::serialization::CSerializable& object);

void save_gridmap(const Grid& grid, const std::string& file);
/// A map of map_server, whose image lies beside the file with the extension .pgm: it is read in less time than one of
/// MRPT's formats, for which a program of its own starts.
void save_map(const Grid& grid, const std::string& file);
void save_truth(const std::string& file, bool seven_columns);
}  // namespace d2s1r::test
