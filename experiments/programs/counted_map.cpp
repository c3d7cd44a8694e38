// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "counted_map.h"

#include <algorithm>
#include <cmath>

namespace d2s1r::experiments
{
namespace
{
using mrpt::poses::CPose2D;

/// Says how the scans saw a cell.
struct Cell
{
	int ends = 0, passes = 0;  //!< [scans] that end in it; that only pass it
	int last = -1;             //!< [index of a scan] that was counted last, so that each counts once
};

/// Counts scans on a grid that holds all that they can draw.
class Counts
{
   public:
	Counts(const std::vector<PlacedScan>& scans, double cell_size, double reach) : cell_size_(cell_size), reach_(reach)
	{
		double x1 = -HUGE_VAL, y1 = -HUGE_VAL;
		for (const PlacedScan& placed : scans)
		{
			x0_ = std::min(x0_, placed.robot.x()), x1 = std::max(x1, placed.robot.x());
			y0_ = std::min(y0_, placed.robot.y()), y1 = std::max(y1, placed.robot.y());
		}
		x0_ = cell_size * std::floor((x0_ - reach) / cell_size - 1);  // cells of all maps lie on one lattice
		y0_ = cell_size * std::floor((y0_ - reach) / cell_size - 1);
		width_ = static_cast<int>((x1 + reach - x0_) / cell_size) + 2;
		height_ = static_cast<int>((y1 + reach - y0_) / cell_size) + 2;
		cells_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
		for (std::size_t i = 0; i < scans.size(); i++) add(scans[i], static_cast<int>(i));
	}

	mrpt::maps::COccupancyGridMap2D::Ptr map() const
	{
		constexpr float kOccupied = 0.02F, kFree = 0.98F;  // [probability] of being free
		auto map = mrpt::maps::COccupancyGridMap2D::Create();
		map->setSize(
		    static_cast<float>(x0_), static_cast<float>(x0_ + width_ * cell_size_), static_cast<float>(y0_),
		    static_cast<float>(y0_ + height_ * cell_size_), static_cast<float>(cell_size_), 0.5F);
		auto cell = cells_.begin();
		for (int y = 0; y < height_; y++)
			for (int x = 0; x < width_; x++, ++cell)
				if (cell->ends + cell->passes > 0)
					map->setCell(x, y, 4 * cell->ends > cell->ends + cell->passes ? kOccupied : kFree);
		return map;
	}

   private:
	Cell& at(double x, double y)
	{
		const auto column = static_cast<std::size_t>((x - x0_) / cell_size_);
		const auto row = static_cast<std::size_t>((y - y0_) / cell_size_);
		return cells_[row * static_cast<std::size_t>(width_) + column];
	}

	void add(const PlacedScan& placed, int index)
	{
		const mrpt::obs::CObservation2DRangeScan& scan = *placed.scan;
		const CPose2D laser = placed.robot + CPose2D(scan.sensorPose);
		const double aperture = static_cast<double>(scan.aperture);
		const double step = aperture / static_cast<double>(scan.getScanSize() - 1);  // [rad]
		for (const bool ends : {true, false})                                        // all ends before all passes
			for (std::size_t i = 0; i < scan.getScanSize(); i++)
			{
				const double range = static_cast<double>(scan.getScanRange(i));
				if (!scan.getScanRangeValidity(i) || range >= reach_) continue;
				const double angle = laser.phi() - aperture / 2 + step * static_cast<double>(i);
				ends ? end(laser, angle, range, index) : pass(laser, angle, range, index);
			}
	}

	void end(const CPose2D& laser, double angle, double range, int index)
	{
		Cell& cell = at(laser.x() + range * std::cos(angle), laser.y() + range * std::sin(angle));
		if (cell.last != index) cell.ends++;
		cell.last = index;
	}

	void pass(const CPose2D& laser, double angle, double range, int index)
	{
		const double dx = std::cos(angle), dy = std::sin(angle);
		for (double way = 0; way < range; way += cell_size_ / 3)
		{
			Cell& cell = at(laser.x() + way * dx, laser.y() + way * dy);
			if (cell.last != index) cell.passes++;
			cell.last = index;
		}
	}

	double cell_size_, reach_;              //!< [m]
	double x0_ = HUGE_VAL, y0_ = HUGE_VAL;  //!< [m] of the grid's corner, in map
	int width_ = 0, height_ = 0;            //!< [cells]
	std::vector<Cell> cells_;
};
}  // namespace

mrpt::maps::COccupancyGridMap2D::Ptr count_map(const std::vector<PlacedScan>& scans, double cell_size, double reach)
{
	return Counts(scans, cell_size, reach).map();
}
}  // namespace d2s1r::experiments
