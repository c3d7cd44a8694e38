// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>

namespace d2s1r
{
/// Says which part of an observation keeps it from being used.
enum class ScanDefect
{
	kNone,
	kAngles,      //!< of its beams
	kMaxRange,    //!< the range up to which the sensor measures
	kSensorPose,  //!< not known, not finite, not on the robot, or tilted
	kFewBeams,    //!< fewer than ScanParameters::min_beams have data
	kNoReturns,   //!< no beam hit anything
	kOther        //!< such as its number of beams, or the times of its sweep
};

/// Returns why make_scan() refuses an observation.
ScanDefect defect_of(const RangeScan& observation, const ScanParameters& parameters, const Sweep& sweep);
}  // namespace d2s1r
