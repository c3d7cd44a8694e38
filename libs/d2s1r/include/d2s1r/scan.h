// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/parameters.h>
#include <mrpt/math/TPose2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>

#include <string>
#include <vector>

namespace d2s1r
{
inline constexpr double kFarthestSensor = 100;  //!< [m] from the origin of the robot; beyond, its pose is a mistake

/// One usable beam of a scan. Not in a Scan are beams without data: NaN, -inf, negative, in range but flagged invalid,
/// and zero unless ScanParameters::zero_is_no_return. What is at or beyond maxRange, flagged or not, saw nothing.
struct Beam
{
	float angle = 0;        //!< [rad] in [-pi, pi), counter-clockwise, sensor frame as seen from above
	float range = 0;        //!< [m] if is_return, else the range up to which nothing was seen
	bool is_return = true;  //!< [-] false: looked and saw nothing up to `range`
};

/// `angle` [rad] as Beam::angle has it.
float beam_angle(double angle);

/// A 2D scan, free of the sensor's conventions: beams counter-clockwise as seen from above.
struct Scan
{
	std::vector<Beam> beams;              //!< by increasing angle
	double field_of_view = 0;             //!< [rad] that the beams cover, in (0, 2 pi]; gaps without data left out
	mrpt::math::TPose2D sensor_on_robot;  //!< sensor in robot frame, m and rad
	std::string invalid_because;          //!< empty if make_scan() found it usable, else the reason

	/// It has beams, a field of view and a finite sensor pose, and make_scan() found no other reason against it. Beams
	/// are checked, too, in a scan made by hand: angles increase within [-pi, pi), and ranges are finite and not
	/// negative.
	bool valid() const;
};

/// Why a scan is not valid().
std::string why_invalid(const Scan& scan);

/// Whether something stands right before the sensor: nine of ten beams end within parameters.covered_within.
bool is_covered(const Scan& scan, const ScanParameters& parameters);

/// The only place that knows about beam order, mounting (offset, yaw, upside down), validity flags and what drivers
/// write for "nothing there". The last beam of a full turn is left out if it looks where the first one does. Never
/// throws: a sensor tilted beyond parameters.max_tilt, too few usable beams or a malformed observation make an invalid
/// Scan.
Scan make_scan(const mrpt::obs::CObservation2DRangeScan& observation, const ScanParameters& parameters);
}  // namespace d2s1r
