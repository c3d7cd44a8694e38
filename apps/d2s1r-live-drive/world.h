// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A robot that wanders through a map.
#pragma once

#include <d2s1r/grid.h>
#include <mrpt/poses/CPose2D.h>

#include <random>
#include <vector>

namespace d2s1r::drive
{
/// Sets the robot, and what is in its building but not on the map.
struct WorldSettings
{
	unsigned seed = 1;             //!< of all that is random
	int beams = 360;               //!< [-] of a scan
	double field_of_view = 360;    //!< [deg] of the laser, around straight ahead
	double range = 20;             //!< [m] of the laser
	double range_noise = 0.01;     //!< [m] standard deviation
	double speed = 0.5;            //!< [m/s]; it turns by twice as many rad/s
	double odometry_error = 0.02;  //!< [-] standard deviation of each measured motion
	int clutter = 0;               //!< [-] things of 0.3 to 1 m that are not on the map
	int people = 0;                //!< [-] that walk through the building
};

/// Where the laser is on the robot [m, rad].
inline const mrpt::poses::CPose2D kLaserOnRobot(0.2, 0.05, 0.1);

/// A building with a robot in it. The same settings give the same drive, whenever the robot is asked where it is and
/// whatever is measured on the way.
class World
{
   public:
	/// \throws std::runtime_error if the robot has room nowhere
	World(Grid grid, const WorldSettings& settings);

	void carry_away();

	/// Lets the robot drive, or turn if something is ahead, for some time [s].
	void move(double seconds);

	/// Returns the ranges [m] of a scan, from right to left; those of beams that meet nothing are infinite.
	std::vector<float> scan();

	const mrpt::poses::CPose2D& pose() const { return pose_; }          //!< robot in map
	const mrpt::poses::CPose2D& odometry() const { return odometry_; }  //!< robot in the frame of its odometry
	double first_angle() const;                                         //!< [rad] of a scan
	double angle_step() const;                                          //!< [rad]

   private:
	mrpt::poses::CPose2D place_with_room();
	bool has_room(double x, double y, double clearance) const;
	double cast(double x, double y, double angle, double range) const;
	double range_to_people(double x, double y, double angle) const;
	void step();
	void walk();

	Grid grid_;  //!< with the clutter
	WorldSettings settings_;
	std::mt19937 random_;  //!< of the building, and of where the robot and people are put
	std::mt19937 walk_;    //!< of where people turn to
	std::mt19937 noise_;   //!< of what is measured
	mrpt::poses::CPose2D pose_, odometry_;
	std::vector<mrpt::poses::CPose2D> people_;
	double turning_ = 0;  //!< [s] for which the robot goes on to turn
	double owed_ = 0;     //!< [s] that it still has to drive, less than a step
};
}  // namespace d2s1r::drive
