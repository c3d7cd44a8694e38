// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// How far the returns of scans end from the walls of the map, which tells how scans have to be read.
#pragma once

#include <d2s1r/localizer.h>

#include <cstddef>
#include <optional>
#include <vector>

namespace d2s1r
{
/// Says by how much nearer to the walls the returns of scans end if the scans are read in another way.
struct WallGain
{
	std::size_t scans = 0;  //!< [-] that were found
	double before = 0;      //!< [m] mean distance from the walls, without the other way
	double gain = 0;        //!< [m] mean; below zero if they end farther away
	double deviation = 0;   //!< [m] standard deviation of the gain, by the spread of the scans

	/// Returns whether the scans show which way is right: the one with the gain, or the other one if it is below zero.
	bool is_clear() const;
};

/// Returns the gain of scans. \param before, after [m] distances from the walls, scan by scan
WallGain wall_gain(const std::vector<double>& before, const std::vector<double>& after);

/// Returns how far [m] a wall is from the sensor, at most `most`. \param sensor in the map frame
/// \param direction [rad] in the map frame
double distance_to_wall(const Grid& grid, const mrpt::math::TPose2D& sensor, double direction, double most);

/// Returns how far [m] behind the end of each return of a scan the first wall in its direction is, within 0.3 m; below
/// zero if the return ends behind the wall. \param robot in the map frame
std::vector<double> walls_behind_returns(const Scan& scan, const mrpt::math::TPose2D& robot, const Grid& grid);

/// Returns how far [m] the returns of a scan end from the first wall in their direction, on average; each counts for at
/// most 0.3 m. \param robot in the map frame
double distance_from_walls(const Scan& scan, const mrpt::math::TPose2D& robot, const Grid& grid);

/// Compares two ways of reading scans by the walls around the places where the scans are found.
class WallComparison
{
   public:
	/// Takes the distances [m] of a scan from the walls in the usual way and in the other one. One without a value,
	/// where the scan is not found, counts for 0.15 m; two show nothing.
	void add(const std::optional<double>& usual, const std::optional<double>& other);

	/// Returns what the other way gains.
	WallGain gain() const { return wall_gain(usual_, other_); }

   private:
	std::vector<double> usual_, other_;  //!< [m]
};

/// Returns by how much [rad] a robot turns while the beams of a scan are taken, by the odometry of its sweep.
double turn_during(const Sweep& sweep, std::size_t beams);
}  // namespace d2s1r
