// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace d2s1r
{
/// Holds an occupancy grid map: how probable it is that each cell is occupied. load_map() reads one, map_of_cells()
/// makes one, and grid_of() of library d2s1r-mrpt takes one from MRPT, whose grids hold the same numbers.
struct OccupancyMap
{
	int width = 0;                   //!< [cells] along x
	int height = 0;                  //!< [cells] along y
	float cell_size = 0;             //!< [m]
	float origin_x = 0;              //!< [m] map frame, lower left corner of cell (0, 0)
	float origin_y = 0;              //!< [m] map frame
	std::vector<std::int8_t> cells;  //!< log-odds, see cell_of(); row-major, the row of least y first

	/// Returns the first cell of a row, by which the others of the row follow.
	std::int8_t* row(int y) { return cells.data() + static_cast<std::ptrdiff_t>(y) * width; }
	/// Returns the same, to be read only.
	const std::int8_t* row(int y) const { return cells.data() + static_cast<std::ptrdiff_t>(y) * width; }

	/// Returns the x coordinate [m, map frame] of the right edge.
	double end_x() const { return static_cast<double>(origin_x) + width * static_cast<double>(cell_size); }

	/// Returns the y coordinate [m, map frame] of the upper edge.
	double end_y() const { return static_cast<double>(origin_y) + height * static_cast<double>(cell_size); }

	/// Returns the probability that a cell of the map is free.
	float p_free(int x, int y) const { return p_free(row(y)[x]); }

	/// Returns the probability that a cell with these log-odds is free.
	static float p_free(std::int8_t cell);

	/// Returns the log-odds [1/16 nat] of being free, from -127 to 127, for the probability of that, in [0, 1].
	static std::int8_t cell_of(float p_free);
};

/// Makes a map of unknown cells, whose lower left corner is at the origin [m, map frame].
/// \param cell_size [m]
/// \throws std::runtime_error if it is empty or too large for memory
OccupancyMap unknown_map(int width, int height, double cell_size, double origin_x, double origin_y);
}  // namespace d2s1r
