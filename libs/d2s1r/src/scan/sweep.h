// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>

namespace d2s1r
{
class SweptMotion
{
   public:
	/// Keeps a reference to `sweep`, whose numbers must be finite.
	/// \param beams [-] of the observation
	SweptMotion(const Sweep& sweep, std::size_t beams);

	/// Returns whether the motion is known: it was measured from the first beam to the last, and time 0, without a gap
	/// of 0.5 s or more, and is none that a robot cannot make.
	bool is_known() const { return is_known_; }

	/// Returns the robot at `time` [s] in the frame of the robot at time 0; the origin if the motion is not known.
	mrpt::math::TPose2D robot_at(double time) const;

	/// Returns the standard deviation [m] of the position, in any direction, that a moved scan leaves to time 0.
	double position_std() const { return std_of(sweep_.unknown_speed, speed_); }

	/// Returns the standard deviation [rad] of the heading that a moved scan leaves to time 0.
	double heading_std() const { return std_of(sweep_.unknown_turn, turn_); }

   private:
	mrpt::math::TPose2D measured_at(double time) const;
	double std_of(double unknown, double known) const;

	const Sweep& sweep_;
	double first_ = 0, last_ = 0;  //!< [s] of the beams
	double unseen_ = 0;            //!< [s^2] an acceleration times this is how far linear motion may be off
	double speed_ = 0, turn_ = 0;  //!< [m/s], [rad/s] greatest that was measured
	bool is_known_ = false;
	mrpt::math::TPose2D at_zero_;  //!< robot at time 0, in the frame of the poses
};

class BeamMover
{
   public:
	/// Keeps a reference to `sweep`, which must be usable: see is_usable(). The observation has two beams or more.
	BeamMover(const RangeScan& observation, const Sweep& sweep);

	/// Returns whether moved() changes any beam.
	bool moves() const { return motion_.is_known(); }

	/// Returns 1 if the beams were recorded counter-clockwise as seen from above, else -1.
	double sign() const { return sign_; }

	/// Returns the pose of the sensor on the robot in the plane, its x axis seen from above, m and rad.
	const mrpt::math::TPose2D& sensor_on_robot() const { return sensor_; }

	/// Returns the angle [rad] of a beam as it was recorded, counter-clockwise in the sensor frame as seen from above.
	double angle_of(std::size_t beam) const;

	/// Returns `read`, whose angle it does not look at, as beam `index` of the observation, at time 0 of the sweep.
	Beam moved(const Beam& read, std::size_t index) const;

	const SweptMotion& motion() const { return motion_; }

   private:
	const Sweep& sweep_;
	SweptMotion motion_;
	mrpt::math::TPose2D sensor_;
	double sign_, aperture_, step_;
};
}  // namespace d2s1r
