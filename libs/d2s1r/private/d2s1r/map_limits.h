// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace d2s1r
{
/// [cells] Size of the largest map that is loaded: 800 m x 800 m at 5 cm.
inline constexpr double kMostCells = 256e6;

/// Checks the size of a map.
/// \throws std::runtime_error if a grid of so many cells along x and y is empty or too large for memory
void check_map_size(double cells_x, double cells_y);

/// Checks the origin of a map.
/// \throws std::invalid_argument if a lower left corner at (x, y) [m, map frame] is not finite, or so far from the
///         origin of the frame that maps, which keep it as floats, have no centimetres there
void check_map_origin(double x, double y);
}  // namespace d2s1r
