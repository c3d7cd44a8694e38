// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/maps/CSimpleMap.h>

#include <limits>
#include <type_traits>
#include <vector>

namespace d2s1r
{
/// [cells] Size of the largest map that is loaded: 800 m x 800 m at 5 cm.
inline constexpr double kMostCells = 256e6;

/// Checks the size of a map.
/// \throws std::runtime_error if a grid of so many cells along x and y is empty or too large for memory
void check_map_size(double cells_x, double cells_y);

/// Checks the origin of a map.
/// \throws std::invalid_argument if a lower left corner at (x, y) [m, map frame] is not finite, or so far from the
///         origin of the frame that MRPT's grids, which keep it as floats, have no centimetres there
void check_map_origin(double x, double y);

/// Makes a map of unknown cells, whose lower left corner is exactly at the origin: COccupancyGridMap2D::setSize() would
/// move it to a multiple of the cell size.
/// \param cell_size, origin_x, origin_y [m]
/// \throws std::runtime_error if it is empty or too large for memory
mrpt::maps::COccupancyGridMap2D::Ptr make_unknown_map(
    int cells_x, int cells_y, double cell_size, double origin_x, double origin_y);

/// Moves the lower left corner of `map` to exactly (x, y) [m, map frame].
void set_origin(mrpt::maps::COccupancyGridMap2D& map, double x, double y);

/// Makes a small map of unknown cells about a robot (map frame), to draw into.
/// \param cell_size [m]
/// \throws std::runtime_error, std::invalid_argument if the pose is not finite or too far from the origin
mrpt::maps::COccupancyGridMap2D::Ptr make_map_around(const mrpt::poses::CPose3D& robot, double cell_size);

/// Draws an observation of a robot (map frame) with the options of `map`, which grows where it needs to.
/// \return whether it was drawn: 2D scans in the plane of the map are
/// \throws std::runtime_error if it holds numbers that are not finite, or the map would become too large for memory
bool draw(
    const mrpt::obs::CObservation& observation, const mrpt::poses::CPose3D& robot,
    mrpt::maps::COccupancyGridMap2D& map);

/// Draws the 2D scans of a simplemap with MRPT's default insertion options.
/// \param cell_size [m]
/// \throws std::runtime_error if it is too large for memory
mrpt::maps::COccupancyGridMap2D::Ptr draw_simple_map(const mrpt::maps::CSimpleMap& keyframes, double cell_size);

/// Tells the class of every value that a cell of an MRPT map can hold, by the thresholds. It is a table, because maps
/// have tens of millions of cells and few different values.
class CellClasses
{
   public:
	using RawCell = mrpt::maps::COccupancyGridMap2D::cellType;

	explicit CellClasses(const GridParameters& parameters);

	/// \param raw log-odds of being free, as in COccupancyGridMap2D::getRow()
	Cell operator[](RawCell raw) const { return classes_[static_cast<std::make_unsigned_t<RawCell>>(raw)]; }

   private:
	std::vector<Cell> classes_;  // by the cell's bits read as unsigned
};

/// Returns whether any cell of `map` is free.
bool has_free_cell(const mrpt::maps::COccupancyGridMap2D& map, const CellClasses& classes);
}  // namespace d2s1r
