// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/array.h"

namespace d2s1r
{
/// [byte] How far kernels read behind the last cell of a map, because they gather cells as words of four bytes.
inline constexpr std::size_t kGatherOverrun = 3;

/// Returns the skip distance of each cell of a map: the Chebyshev distance [cells] to the nearest cell of another
/// class, at most `most`, and 0 in a margin of one cell, which counts as another class. kGatherOverrun bytes follow.
/// \param classes row-major, with the margin
/// \param width [cells] with the margin
std::vector<std::uint8_t> skip_distances(const AlignedBytes& classes, int width, int most);

/// The cells of a map, and of a margin of one cell around it, with their skip distances: how far a ray may go in any
/// direction before it meets something new. A map may be read in two ways, which differ inside of walls only, so that
/// both have one byte per cell in common. Copies share it.
struct SkipMap
{
	static constexpr int kKindBits = 4;             //!< [bit] of a cell that tell its kind: the upper ones
	static constexpr int kFirstOfWalls = 8;         //!< from this kind on it is occupied in some reading
	static constexpr int kMostSkipped = 63;         //!< [cells]
	static constexpr int kMostSkippedInWalls = 15;  //!< [cells]
	static constexpr int kOccupied = 1;  //!< the bit of a class that all classes of occupied cells have, and no other
	static constexpr std::uint8_t kFree = 0, kWall = 1, kUnknown = 2;  //!< classes: those of Cell
	static constexpr std::uint8_t kFurniture = 3;                      //!< class of occupied cells of furniture

	/// By kind of cell, its classes in the map as it is drawn and with the surfaces of its walls deeper. Free and
	/// unknown cells have four kinds each, whose lower bits belong to the skip distance. What is inside of a wall is
	/// unknown, and in the second reading never unless it is in the first one.
	static constexpr std::array<std::array<std::uint8_t, 2>, 1 << kKindBits> kClasses{
	    {{kFree, kFree},
	     {kFree, kFree},
	     {kFree, kFree},
	     {kFree, kFree},
	     {kUnknown, kUnknown},
	     {kUnknown, kUnknown},
	     {kUnknown, kUnknown},
	     {kUnknown, kUnknown},
	     {kWall, kWall},
	     {kWall, kFree},
	     {kFurniture, kFurniture},
	     {kFurniture, kFree},
	     {kUnknown, kFree},
	     {kUnknown, kWall},
	     {kUnknown, kFurniture},
	     {kWall, kUnknown}}};

	int width = 0, height = 0;          //!< [cells] with the margin
	double cell_size = 0;               //!< [m]
	double origin_x = 0, origin_y = 0;  //!< [m] map frame, lower left corner of the margin
	/// By cell, row-major, its kind above its skip distance, which is 0 in the margin. kGatherOverrun bytes follow.
	Array<std::uint8_t> cells;

	/// Returns the class of a cell of `cells` in a reading, 0 or 1.
	static int class_of(std::uint8_t cell, int reading)
	{
		return kClasses[static_cast<std::size_t>(cell >> (8 - kKindBits))][static_cast<std::size_t>(reading)];
	}

	/// Returns the skip distance [cells] of a cell of `cells`.
	static int skip_of(std::uint8_t cell)
	{
		return cell & (cell >> (8 - kKindBits) < kFirstOfWalls ? kMostSkipped : kMostSkippedInWalls);
	}

	/// Returns the classes of all kinds in a reading, two bits each, that of the first kind lowest.
	static constexpr std::uint32_t classes_of_kinds(int reading)
	{
		std::uint32_t all = 0;
		for (std::size_t kind = 0; kind < kClasses.size(); kind++)
			all |= std::uint32_t{kClasses[kind][static_cast<std::size_t>(reading)]} << 2 * kind;
		return all;
	}

	std::size_t index(int column, int row) const
	{
		return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
	}

	bool is_inside(int column, int row) const
	{
		return column > 0 && row > 0 && column < width - 1 && row < height - 1;
	}

	/// Returns whether a cell is occupied in a reading; in the margin and beyond it none is.
	bool is_occupied(int column, int row, int reading) const
	{
		return is_inside(column, row) && (class_of(cells[index(column, row)], reading) & kOccupied) != 0;
	}

	/// Returns whether a sensor may stand at (x, y) [m] in the map frame: on the map, and in a free cell, or at most
	/// `beside` [m], along each axis, from one that no wall separates it from in a reading.
	bool may_stand(double x, double y, double beside, int reading) const;

	template <class Self, class File>
	static void fields(Self& self, File& file)
	{
		geometry_fields(self, file);
		file(self.cells);
	}
};

/// Makes the map of a grid.
/// \param furniture cells that count as furniture where they are occupied: see find_furniture()
SkipMap make_skip_map(const Grid& grid, const std::vector<CellIndex>& furniture = {});

/// Makes the map of a grid that is read in two ways: see SkipMap::kClasses.
/// \param drawn, deeper of the same size
SkipMap make_skip_map(const Grid& drawn, const Grid& deeper, const std::vector<CellIndex>& furniture);
}  // namespace d2s1r
