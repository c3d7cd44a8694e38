// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/beam_tracer.h>

namespace d2s1r
{
/// See BeamTracer::cells_.
struct PackedCells
{
	const std::uint8_t* cells;
	int width, height;  //!< [cells] margin included
	double cell_size;   //!< [m]
};

/// The inner loop of BeamTracer::trace().
/// \param u, v [cells] of the sensor, from the corner of the margin; within the grid
/// \param heading [rad] of the sensor
void trace_beams(
    const PackedCells& map, double u, double v, double heading, const BeamEnds& beams, bool only_ends,
    TracedBeams& traced);
}  // namespace d2s1r
