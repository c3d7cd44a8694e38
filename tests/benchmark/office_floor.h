// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

namespace d2s1r::benchmark
{
/// A generated floor of an office building: corridors, rooms with doors, furniture; unknown outside.
/// \param area [m^2] of the whole floor
/// \param cell_size [m]
/// \return the same floor for the same arguments, on any machine
Grid make_office_floor(double area, double cell_size, unsigned seed);
}  // namespace d2s1r::benchmark
