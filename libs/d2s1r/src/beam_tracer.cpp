// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/beam_tracer.h>

#include <algorithm>

#include "beam_tracer_kernel.h"

namespace d2s1r
{
namespace
{
constexpr int kMostClearance = 63;   //!< [cells] six bits
constexpr std::size_t kOverrun = 3;  //!< [bytes]

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
    : width_(grid.width + 2),
      height_(grid.height + 2),
      cell_size_(grid.cell_size),
      origin_x_(grid.origin_x - grid.cell_size),
      origin_y_(grid.origin_y - grid.cell_size),
      cells_(
          static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) + kOverrun,
          static_cast<std::uint8_t>(Cell::kUnknown))
{
	const Clearances clearances(grid);
	std::size_t from = 0;
	for (int row = 0; row < grid.height; row++)
	{
		auto to = cells_.begin() + static_cast<std::ptrdiff_t>(row + 1) * width_ + 1;
		for (int column = 0; column < grid.width; column++, from++)
			*to++ = static_cast<std::uint8_t>((clearances.at(from) << kClassBits) | static_cast<int>(grid.cells[from]));
	}
}

void BeamTracer::trace(const BeamEnds& beams, const mrpt::math::TPose2D& sensor, TracedBeams& traced) const
{
	trace(beams, sensor, false, traced);
}

void BeamTracer::locate_ends(const BeamEnds& beams, const mrpt::math::TPose2D& sensor, TracedBeams& traced) const
{
	trace(beams, sensor, true, traced);
}

void BeamTracer::trace(
    const BeamEnds& beams, const mrpt::math::TPose2D& sensor, bool only_ends, TracedBeams& traced) const
{
	const std::size_t count = beams.range.size();
	traced.walls.resize(count);
	traced.unknown.resize(count);
	traced.end.resize(count);
	const double u = (sensor.x - origin_x_) / cell_size_, v = (sensor.y - origin_y_) / cell_size_;
	if (u >= 1 && v >= 1 && u < width_ - 1 && v < height_ - 1)
	{
		trace_beams({cells_.data(), width_, height_, cell_size_}, u, v, sensor.phi, beams, only_ends, traced);
		return;
	}
	for (std::size_t i = 0; i < count; i++)
	{
		traced.walls[i] = 0;
		traced.unknown[i] = only_ends ? 0 : beams.range[i];
		traced.end[i] = static_cast<std::int32_t>(Cell::kUnknown);
	}
}
}  // namespace d2s1r
