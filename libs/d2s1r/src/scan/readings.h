// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>

#include <optional>
#include <vector>

namespace d2s1r
{
/// Holds what the laser measured, beam by beam in the order of the observation; the angles are not set. A beam without
/// data has no value.
using Readings = std::vector<std::optional<Beam>>;

/// Reads all beams of an observation, each for itself. Nothing else knows what drivers and logs write.
Readings read_each(const RangeScan& observation, const ScanParameters& parameters);

/// Takes out the returns that share exactly their range with many others that are not their neighbours: a dirty window,
/// or a value that a driver writes instead of a measurement.
/// \return number of beams taken out
std::size_t take_out_repeated(Readings& readings);

/// Takes out all no-returns if many of them lie in gaps of a surface: such a laser writes "nothing there" for beams
/// that it lost. \param step [rad] between neighbouring beams \return number of beams taken out
std::size_t take_out_lost(Readings& readings, double step, const ScanParameters& parameters);
}  // namespace d2s1r
