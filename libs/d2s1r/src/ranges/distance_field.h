// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include "base/array.h"

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
/// out of the grid, whose edge the outer walls of a building are. It needs two bytes per cell of the grid. The
/// transform is that of Felzenszwalb and Huttenlocher, "Distance Transforms of Sampled Functions", 2012. Const and
/// thread-safe.
class DistanceField
{
   public:
	static constexpr float kUnitsPerCell = 1024;  //!< [-] in which distances are stored
	static constexpr float kReachCells = 32;      //!< [cells] beyond, the distance is cut off

	/// Computes the distances of `grid`.
	/// \param tolerance [m] how far from the centres of occupied cells the walls may be: distances are counted from
	///        there on
	/// \throws std::invalid_argument if there are more than 2^30 cells
	explicit DistanceField(const Grid& grid, double tolerance = 0);

	/// Makes an empty one, for fields() to read into.
	DistanceField() = default;

	/// Returns the distance at (x, y) [m, map frame]; far outside of the grid it is the greatest one, with no gradient.
	Distance at(double x, double y) const;

	double cell_size() const { return cell_size_; }  //!< [m]
	double tolerance() const { return tolerance_; }  //!< [m]
	double origin_x() const { return origin_x_; }    //!< [m] lower left corner of the first cell, map frame
	double origin_y() const { return origin_y_; }    //!< [m]
	int width() const { return width_; }             //!< [cells]
	int height() const { return height_; }           //!< [cells]
	const std::uint16_t* cells() const { return cells_.data(); }  //!< [cell_size / kUnitsPerCell] row-major

	/// Lists what an index file holds of the field.
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

   private:
	int width_ = 0, height_ = 0;                          //!< [cells] of the grid and a rim about it
	double cell_size_ = 0, origin_x_ = 0, origin_y_ = 0;  //!< [m] map frame
	double tolerance_ = 0;                                //!< [m]
	Array<std::uint16_t> cells_;                          //!< [cell_size / kUnitsPerCell] row-major
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
	const std::uint16_t* corner = cells_.data() + static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) + i;
	const float a = corner[0], b = corner[1], c = corner[width_], d = corner[width_ + 1];
	const float lower = a + (b - a) * u, upper = c + (d - c) * u;
	constexpr float kCells = 1 / kUnitsPerCell;
	return {
	    (lower + (upper - lower) * v) * kCells * cell_size, ((b - a) * (1 - v) + (d - c) * v) * kCells,
	    (upper - lower) * kCells};
}
}  // namespace d2s1r
