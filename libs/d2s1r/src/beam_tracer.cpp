// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/beam_tracer.h>

#include "beam_tracer_kernel.h"
#include "clearance.h"

namespace d2s1r
{
namespace
{
constexpr int kMostClearance = 63;  //!< [cells] six bits
}  // namespace

BeamTracer::BeamTracer(const Grid& grid)
    : width_(grid.width + 2),
      height_(grid.height + 2),
      cell_size_(grid.cell_size),
      origin_x_(grid.origin_x - grid.cell_size),
      origin_y_(grid.origin_y - grid.cell_size)
{
	std::vector<std::uint8_t> classes(
	    static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_),
	    static_cast<std::uint8_t>(Cell::kUnknown));
	auto from = grid.cells.begin();
	for (int row = 1; row + 1 < height_; row++)
	{
		auto to = classes.begin() + static_cast<std::ptrdiff_t>(row) * width_ + 1;
		for (int column = 0; column < grid.width; column++) *to++ = static_cast<std::uint8_t>(*from++);
	}
	cells_ = clearances(classes, width_, kMostClearance);
	for (std::size_t cell = 0; cell < classes.size(); cell++)
		cells_[cell] = static_cast<std::uint8_t>((cells_[cell] << kClassBits) | classes[cell]);
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
