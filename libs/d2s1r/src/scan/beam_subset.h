// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "base/simd.h"

#include <d2s1r/scan.h>

#include <cstdint>
#include <vector>

namespace d2s1r
{
/// Beams as arrays, coordinate by coordinate. They are padded to whole vectors by beams of negative range, which end
/// far outside of any map.
struct BeamArrays
{
	std::vector<float> unit_x, unit_y;  //!< [-] unit vectors, sensor frame
	std::vector<float> range;           //!< [m]
};

/// Some beams of a scan, evenly spread over it.
struct BeamSubset
{
	BeamArrays returns;  //!< counter-clockwise; those of a full circle begin where a segment does
	/// [-] ln(range / 3 m) of each return, its range limited to 0.5 to 20 m; not padded.
	std::vector<float> log_range;
	/// 1 for a return that begins a run: on its clockwise side is a beam that saw nothing, or more than 10 deg without
	/// data.
	std::vector<std::uint8_t> starts_run;
	/// 1 for a return with a depth edge on its clockwise side: the neighbour there, also a return and not more than
	/// 10 deg apart, is more than 0.5 m nearer or further, and by more than a surface could explain that beams
	/// `spacing` apart meet at 4 deg or more.
	std::vector<std::uint8_t> depth_edge;
	/// 1 for a return that begins a segment: a straight piece of neighbours within 10 cm of a line, without a depth
	/// edge.
	std::vector<std::uint8_t> starts_segment;
	BeamArrays no_returns;  //!< beams that saw nothing, up to the reach of the sensor, at most 20 m
	std::size_t count = 0;  //!< [-] number of beams, those that saw nothing included
	double spacing = 0;     //!< [rad] between neighbours that no gap parts: the angle that one beam stands for
};

/// Selects every n-th beam of `scan`, at most `most`. The least n is chosen with which they are apart by about 1 deg or
/// more. Thread-safe, as the following functions are.
BeamSubset select_beams(const Scan& scan, int most);

/// Returns the few beams that many poses are first judged by: 45 at most.
BeamSubset few_beams(const Scan& scan);

/// Returns the many beams that the better poses are refined with: 180 at most.
BeamSubset many_beams(const Scan& scan);

/// Returns all beams that are used, which decide: 360 at most.
BeamSubset all_beams(const Scan& scan);

/// Returns the share [0, 1] of the returns of `scan` that stand alone: between them and both of their neighbours is a
/// depth edge. Dust, rain, and a dirty laser make such returns; people, chairs and walls make few.
double share_of_lone_returns(const Scan& scan);
}  // namespace d2s1r
