// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>

#include <cstdint>
#include <vector>

#include "base/simd.h"

namespace d2s1r
{
/// Ends of beams, coordinate by coordinate; padded to whole vectors by ones that have a negative range and end far
/// outside of any map.
struct BeamArrays
{
	std::vector<float> unit_x, unit_y;  //!< unit vectors, sensor frame
	std::vector<float> range;           //!< [m]
};

/// Some beams of a scan, evenly spread.
struct BeamSubset
{
	BeamArrays returns;            //!< counter-clockwise; of a full circle, from where a surface begins
	std::vector<float> log_range;  //!< ln of range / 3 m of each return, range within 0.5 and 20 m; not padded
	/// 1 for a return that has a beam that ended at nothing, or more than 10 deg without data, on its clockwise side
	std::vector<std::uint8_t> starts_run;
	/// 1 for a return whose neighbour on its clockwise side, also a return and not more than 10 deg apart, is more than
	/// 0.5 m nearer or further, and by more than any surface that beams `spacing` apart see at 4 deg or more could
	/// explain
	std::vector<std::uint8_t> depth_edge;
	/// 1 for a return that begins a straight piece of surface: neighbours within 10 cm of a line, without a depth edge
	std::vector<std::uint8_t> starts_surface;
	BeamArrays no_returns;  //!< beams that ended at nothing, up to the reach of the sensor, at most 20 m
	std::size_t count = 0;  //!< [-] beams, those that ended at nothing included
	double spacing = 0;     //!< [rad] between neighbours that no gap parts: what a ray stands for
};

/// At most `most` beams of `scan`: every n-th, n chosen for a distance nearest to `spacing` [rad]. Thread-safe, as
/// the following.
BeamSubset select_beams(const Scan& scan, double spacing, int most);

/// What a fit or a score of many poses is first judged by: 4 deg apart, 45 at most.
BeamSubset few_beams(const Scan& scan);

/// What the better ones are refined with: 1 deg apart, 180 at most.
BeamSubset many_beams(const Scan& scan);

/// What decides: 1 deg apart, 360 at most.
BeamSubset all_beams(const Scan& scan);
}  // namespace d2s1r
