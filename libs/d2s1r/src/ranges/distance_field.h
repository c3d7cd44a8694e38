// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/array.h"
#include "ranges/skip_distances.h"

namespace d2s1r
{
/// A distance to the walls and its gradient.
struct Distance
{
	float value = 0;       //!< [m] to the centre of the nearest occupied cell, at most DistanceField::kReachCells cells
	float gradient_x = 0;  //!< [-] d value / d x, map frame
	float gradient_y = 0;  //!< [-] d value / d y
};

/// Holds the Euclidean distance to the nearest occupied cell, bilinear between the centres of cells, also a little way
/// out of the grid, whose edge the outer walls of a building are. It needs one byte per cell of the grid, which codes
/// the distance: exactly up to ten cells, to 0.07 cells beyond. The transform is that of Felzenszwalb and Huttenlocher,
/// "Distance Transforms of Sampled Functions", 2012. Const and thread-safe.
class DistanceField
{
   public:
	static constexpr float kReachCells = 32;  //!< [cells] beyond, the distance is cut off
	static constexpr float kExactCells = 10;  //!< [cells] codes up to the square of this are squares of distances
	static constexpr int kExactCodes = 100;
	/// [cells] between two codes above, of which 255 is that of the reach
	static constexpr float kCellsPerCode = (kReachCells - kExactCells) / (255 - kExactCodes);

	/// Computes the distances of `grid`.
	/// \param tolerance [m] how far from the centres of occupied cells the walls may be: distances are counted from
	///        there on
	/// \throws std::invalid_argument if the grid, with a rim of 32 cells about it, has 2^31 cells or more
	explicit DistanceField(const Grid& grid, double tolerance = 0);

	/// Computes the distances of a reading of `map`: see BeamTracer.
	DistanceField(const SkipMap& map, int reading, double tolerance);

	DistanceField() = default;

	/// Returns the distance at (x, y) [m, map frame]; far outside of the grid it is the greatest one, with no gradient.
	Distance at(double x, double y) const;

	double cell_size() const { return cell_size_; }  //!< [m]
	double tolerance() const { return tolerance_; }  //!< [m]
	double origin_x() const { return origin_x_; }    //!< [m] lower left corner of the first cell, map frame
	double origin_y() const { return origin_y_; }    //!< [m]
	int width() const { return width_; }             //!< [cells]
	int height() const { return height_; }           //!< [cells]
	/// Codes of the distances, row-major, and kGatherOverrun bytes after the last; see distance_of_code().
	const std::uint8_t* cells() const { return cells_.data(); }

	/// Returns the distance [cells] that a code stands for; the tolerance is not subtracted from it.
	static float distance_of_code(std::uint8_t code)
	{
		const float number = code;
		return std::max(std::sqrt(number), kCellsOfCode0 + kCellsPerCode * number);
	}

	template <class Self, class File>
	static void fields(Self& self, File& file)
	{
		file(self.width_);
		file(self.height_);
		file(self.cell_size_);
		file(self.origin_x_);
		file(self.origin_y_);
		file(self.tolerance_);
		file(self.cells_);
	}

	static constexpr float kCellsOfCode0 = kExactCells - kCellsPerCode * kExactCodes;  //!< [cells] by the linear part

   private:
	template <class IsOccupied>
	void fill(const IsOccupied& is_occupied);

	int width_ = 0, height_ = 0;                          //!< [cells] of the grid and a rim about it
	double cell_size_ = 0, origin_x_ = 0, origin_y_ = 0;  //!< [m] map frame
	double tolerance_ = 0;                                //!< [m]
	Array<std::uint8_t> cells_;                           //!< see cells()
};

inline Distance DistanceField::at(double x, double y) const
{
	const auto column = static_cast<float>((x - origin_x_) / cell_size_ - 0.5);
	const auto row = static_cast<float>((y - origin_y_) / cell_size_ - 0.5);
	const auto cell_size = static_cast<float>(cell_size_);
	if (!(column >= 0 && row >= 0 && column < static_cast<float>(width_ - 1) && row < static_cast<float>(height_ - 1)))
		return {kReachCells * cell_size, 0, 0};
	const int i = static_cast<int>(column), j = static_cast<int>(row);
	const float u = column - static_cast<float>(i), v = row - static_cast<float>(j);
	const std::uint8_t* corner = cells_.data() + static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) + i;
	const auto tolerance = static_cast<float>(tolerance_ / cell_size_);
	const auto distance = [=](std::uint8_t code) { return std::max(0.0F, distance_of_code(code) - tolerance); };
	const float a = distance(corner[0]), b = distance(corner[1]);
	const float c = distance(corner[width_]), d = distance(corner[width_ + 1]);
	const float lower = a + (b - a) * u, upper = c + (d - c) * u;
	return {(lower + (upper - lower) * v) * cell_size, (b - a) * (1 - v) + (d - c) * v, upper - lower};
}
}  // namespace d2s1r
