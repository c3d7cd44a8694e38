// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/beam_tracer.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace d2s1r
{
namespace
{
constexpr int kMostClearance = 63;  //!< [cells] six bits
constexpr int kClassBits = 2;

/// Chebyshev distance [cells] to the nearest cell of another class, by two passes of a chamfer; the border of the grid
/// counts as another class.
class Clearances
{
   public:
	explicit Clearances(const Grid& grid) : grid_(grid), distance_(grid.cells.size(), 1)
	{
		for (int row = 1; row + 1 < grid.height; row++)
			for (int column = 1; column + 1 < grid.width; column++) relax(grid.index(column, row), -1);
		for (int row = grid.height - 2; row > 0; row--)
			for (int column = grid.width - 2; column > 0; column--) relax(grid.index(column, row), 1);
	}

	std::uint8_t at(std::size_t cell) const { return distance_[cell]; }

   private:
	/// Looks at the four neighbours that a pass in raster order (direction -1) or against it (1) has settled.
	void relax(CellIndex cell, int direction)
	{
		const Cell own = grid_.cells[static_cast<std::size_t>(cell)];
		const int line = direction * grid_.width;
		int least = kMostClearance - 1;
		for (const int neighbour : {cell + direction, cell + line - 1, cell + line, cell + line + 1})
		{
			const auto n = static_cast<std::size_t>(neighbour);
			least = std::min(least, grid_.cells[n] == own ? static_cast<int>(distance_[n]) : 0);
		}
		auto& distance = distance_[static_cast<std::size_t>(cell)];
		const auto through = static_cast<std::uint8_t>(least + 1);
		distance = direction < 0 ? through : std::min(distance, through);
	}

	const Grid& grid_;
	std::vector<std::uint8_t> distance_;
};
}  // namespace

BeamTracer::BeamTracer(const Grid& grid)
    : width_(grid.width),
      height_(grid.height),
      cell_size_(grid.cell_size),
      origin_x_(grid.origin_x),
      origin_y_(grid.origin_y),
      cells_(grid.cells.size())
{
	const Clearances clearances(grid);
	for (std::size_t i = 0; i < cells_.size(); i++)
		cells_[i] = static_cast<std::uint8_t>((clearances.at(i) << kClassBits) | static_cast<int>(grid.cells[i]));
}

Passed BeamTracer::trace(double x, double y, double dx, double dy, double range) const
{
	constexpr double kAtWall = 0.15;  //!< [m] a wall this near to the end is where the beam ended
	constexpr double kNudge = 1e-6;   //!< [cells] over the border of a cell
	constexpr double kNever = std::numeric_limits<double>::infinity();
	const double column = (x - origin_x_) / cell_size_, row = (y - origin_y_) / cell_size_;
	const double end = range / cell_size_, passed_before = end - kAtWall / cell_size_;
	const double per_column = dx != 0 ? 1 / dx : kNever, per_row = dy != 0 ? 1 / dy : kNever;
	const double per_square = 1 / std::max(std::abs(dx), std::abs(dy));

	Passed passed;
	double unknown = 0;
	bool in_wall = false;
	for (double t = 0; t < end;)
	{
		const double u = column + dx * t, v = row + dy * t;
		if (!(u >= 0 && v >= 0 && u < width_ && v < height_))
		{
			unknown += end - t;
			break;
		}
		const int i = static_cast<int>(u), j = static_cast<int>(v);
		const std::uint8_t packed =
		    cells_[static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(i)];
		const auto cell = static_cast<Cell>(packed & ((1 << kClassBits) - 1));
		const int clearance = packed >> kClassBits;
		double next;
		if (clearance > 1)
			next = t + (clearance - 1) * per_square;
		else
		{
			const double to_column = dx != 0 ? ((dx > 0 ? i + 1 : i) - column) * per_column : kNever;
			const double to_row = dy != 0 ? ((dy > 0 ? j + 1 : j) - row) * per_row : kNever;
			next = std::max(std::min(to_column, to_row), t) + kNudge;
		}
		if (cell == Cell::kUnknown) unknown += std::min(next, end) - t;
		if (in_wall && cell != Cell::kOccupied && t < passed_before) passed.walls++;
		in_wall = cell == Cell::kOccupied;
		t = next;
	}
	passed.unknown = static_cast<float>(unknown * cell_size_);
	return passed;
}

Cell BeamTracer::at(double x, double y) const
{
	const double u = (x - origin_x_) / cell_size_, v = (y - origin_y_) / cell_size_;
	if (!(u >= 0 && v >= 0 && u < width_ && v < height_)) return Cell::kUnknown;
	const auto cell = static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
	return static_cast<Cell>(cells_[cell] & ((1 << kClassBits) - 1));
}
}  // namespace d2s1r
