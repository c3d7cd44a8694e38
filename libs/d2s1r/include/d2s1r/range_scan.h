// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/poses/CPose3D.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace d2s1r
{
/// Holds what the driver of a 2D laser wrote about one sweep, in its own conventions; make_scan() makes a Scan of it,
/// which has none. scan_of() of library d2s1r-mrpt takes it from a CObservation2DRangeScan.
struct RangeScan
{
	std::vector<float> ranges;        //!< [m] beam by beam, as they were recorded: see Beam for what they may hold
	std::vector<std::uint8_t> valid;  //!< [-] by beam: 0 if the driver flags it; those beyond the end are valid
	float aperture = 0;               //!< [rad] from the first beam to the last; their middle is the sensor's x axis
	bool right_to_left = true;        //!< whether the beams were recorded counter-clockwise in the sensor frame
	float max_range = 80;             //!< [m] up to which the sensor measures
	double delta_pitch = 0;           //!< [rad] by which the sensor's plane nods during the sweep
	mrpt::poses::CPose3D sensor_on_robot;  //!< sensor in robot frame; upside down if its roll or pitch is pi

	/// Returns the number of beams.
	std::size_t size() const { return ranges.size(); }

	/// Returns whether the driver takes a beam for valid.
	bool is_valid(std::size_t beam) const { return beam >= valid.size() || valid[beam] != 0; }
};
}  // namespace d2s1r
