// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/parameters.h>
#include <d2s1r/range_scan.h>
#include <mrpt/math/CMatrixFixed.h>
#include <mrpt/math/TPose2D.h>
#include <mrpt/math/TTwist2D.h>

#include <cstddef>
#include <string>
#include <vector>

namespace d2s1r
{
/// Says how far [m] a sensor may be from the origin of the robot; beyond, its pose is a mistake.
inline constexpr double kFarthestSensor = 100;

/// Describes one usable beam of a scan. Beams without data are not in a Scan: those that are NaN, -inf or negative,
/// those in range but flagged invalid, those of zero unless ScanParameters::zero_is_no_return, those that share exactly
/// their range with many others that are not their neighbours, and no-returns by ScanParameters::no_return. A beam
/// whose range is at or beyond maxRange, flagged or not, saw nothing.
struct Beam
{
	float angle = 0;        //!< [rad] in [-pi, pi), counter-clockwise, sensor frame as seen from above
	float range = 0;        //!< [m] to what the beam hit, or, if it is no return, up to where it saw nothing
	bool is_return = true;  //!< [-] whether the beam hit something
};

/// Returns `angle` [rad] wrapped to where Beam::angle lies.
float beam_angle(double angle);

/// Holds a 2D scan that is free of the sensor's conventions: its beams are counter-clockwise as seen from above.
struct Scan
{
	std::vector<Beam> beams;              //!< by increasing angle
	double field_of_view = 0;             //!< [rad] that the beams cover, in (0, 2 pi]; gaps without data left out
	mrpt::math::TPose2D sensor_on_robot;  //!< sensor in robot frame, m and rad
	double position_std = 0;   //!< [m] standard deviation that the motion during the sweep adds to a pose, in x and y
	double heading_std = 0;    //!< [rad] standard deviation that it adds to a heading
	std::size_t repeated = 0;  //!< [-] beams left out because too many others share exactly their range
	std::size_t lost = 0;      //!< [-] no-returns left out because most lie in gaps of a surface
	std::string invalid_because;  //!< empty if make_scan() found it usable, else the reason

	/// Returns whether the scan can be used: it has beams, a field of view and a finite sensor pose within
	/// kFarthestSensor, and make_scan() found no other reason against it. The beams of a scan that was made by hand are
	/// checked, too: their angles increase within [-pi, pi), and their ranges are finite and not negative.
	bool valid() const;
};

/// Says why a scan is not valid().
std::string why_invalid(const Scan& scan);

/// Returns the covariance of (x, y, phi), m^2 and rad^2, that the motion during the sweep adds to a pose of the robot.
mrpt::math::CMatrixDouble33 motion_covariance(const Scan& scan);

/// Says where the robot was at a time.
struct TimedPose
{
	double time = 0;            //!< [s] after the time that a scan is asked for
	mrpt::math::TPose2D robot;  //!< robot in a frame that does not move, such as that of the odometry, m and rad
};

/// Returns the pose at a share [0, 1] of the straight way from one pose to another; beyond 1, the way goes on.
mrpt::math::TPose2D pose_between(const mrpt::math::TPose2D& from, const mrpt::math::TPose2D& to, double share);

/// Says when a laser took each beam of an observation, and how the robot moved meanwhile. A spinning laser takes 0.1 to
/// 0.2 s for a turn; what it sees from a robot that turns by 1 rad/s is twisted by 6 to 11 deg. make_scan() moves every
/// beam to one time, time 0 of the sweep, and the pose of the robot is that of this time.
///
/// Where nobody measured the motion, the beams stay as they are: they show the robot in the middle of the sweep. The
/// covariances of the answer then include how far the robot may have moved from there to time 0.
struct Sweep
{
	double first_beam = 0;  //!< [s] time of the first beam of the observation; 0 if its stamp is that of this beam
	double beam_step = 0;   //!< [s] from one beam to the next, as they are recorded; negative if the last was first
	std::vector<TimedPose> motion;  //!< by increasing time; empty: nobody measured the motion

	double unknown_speed = 0.5;  //!< [m/s] standard deviation of a speed that nobody measured
	/// [rad/s] Standard deviation of a turn that nobody measured: that of a robot which turns as often by any rate up
	/// to 2.84 rad/s, the fastest of a TurtleBot3.
	double unknown_turn = 1.64;

	/// Returns the time [s] of a beam of the observation.
	double time_of(std::size_t beam) const { return first_beam + beam_step * static_cast<double>(beam); }

	/// Returns whether all beams were taken at time 0, so that there is nothing to move.
	bool is_instant() const { return first_beam == 0 && beam_step == 0; }
};

/// Returns the poses of a robot that moves by a constant twist, [m/s] and [rad/s] in its own frame, for Sweep::motion.
/// \param from, to [s] the first and the last time
std::vector<TimedPose> poses_along(const mrpt::math::TTwist2D& twist, double from, double to);

/// Returns whether the numbers of a sweep are finite, its poses in order, and its beams within 10 s of time 0.
bool is_usable(const Sweep& sweep, std::size_t beams);

/// Returns the sweep of an observation; one that is_instant() if its numbers are not usable.
/// \param first_beam [s] time of the first beam, as Sweep has it
/// \param duration [s] from the first beam to the last; negative if the last was first
/// \param beams [-] of the observation
Sweep make_sweep(double first_beam, double duration, std::size_t beams, std::vector<TimedPose> motion);

/// Returns an observation as if the laser had taken all beams at time 0 of the sweep, for what reads observations
/// itself, such as a particle filter. Each beam becomes that of the direction nearest to it; directions that no beam
/// looked in become invalid. make_scan() does not round directions. Thread-safe.
RangeScan at_one_time(const RangeScan& observation, const Sweep& sweep);

/// Returns whether the sensor is covered: nine of ten beams end within parameters.covered_within.
bool is_covered(const Scan& scan, const ScanParameters& parameters);

/// Makes a Scan of an observation. Nothing else knows about the order of beams, the mounting of the sensor (offset,
/// yaw, upside down), validity flags, and what drivers write for "nothing there". The last beam of a full turn is left
/// out if it looks where the first one does. It never throws: a sensor tilted beyond parameters.max_tilt, too few
/// usable beams or a malformed observation make an invalid Scan.
/// \param sweep when each beam was taken: all beams are moved to its time 0
Scan make_scan(const RangeScan& observation, const ScanParameters& parameters, const Sweep& sweep = {});
}  // namespace d2s1r
