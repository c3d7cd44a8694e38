// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/parameters.h>
#include <mrpt/math/TPose2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>

#include <string>
#include <vector>

namespace d2s1r
{
/// Says how far [m] a sensor may be from the origin of the robot; beyond, its pose is a mistake.
inline constexpr double kFarthestSensor = 100;

/// Describes one usable beam of a scan. Beams without data are not in a Scan: those that are NaN, -inf or negative,
/// those in range but flagged invalid, and those of zero unless ScanParameters::zero_is_no_return. A beam whose range
/// is at or beyond maxRange, flagged or not, saw nothing.
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
	std::string invalid_because;          //!< empty if make_scan() found it usable, else the reason

	/// Returns whether the scan can be used: it has beams, a field of view and a finite sensor pose within
	/// kFarthestSensor, and make_scan() found no other reason against it. The beams of a scan that was made by hand are
	/// checked, too: their angles increase within [-pi, pi), and their ranges are finite and not negative.
	bool valid() const;
};

/// Says why a scan is not valid().
std::string why_invalid(const Scan& scan);

/// Returns whether the sensor is covered: nine of ten beams end within parameters.covered_within.
bool is_covered(const Scan& scan, const ScanParameters& parameters);

/// Makes a Scan of an observation. Nothing else knows about the order of beams, the mounting of the sensor (offset,
/// yaw, upside down), validity flags, and what drivers write for "nothing there". The last beam of a full turn is left
/// out if it looks where the first one does. It never throws: a sensor tilted beyond parameters.max_tilt, too few
/// usable beams or a malformed observation make an invalid Scan.
Scan make_scan(const mrpt::obs::CObservation2DRangeScan& observation, const ScanParameters& parameters);
}  // namespace d2s1r
