// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "made_floors.h"

#include <d2s1r/map_io.h>

#include <algorithm>
#include <cmath>

namespace d2s1r::experiments
{
namespace
{
constexpr double kReach = 30;  //!< [m] of the laser

/// Returns the angle [rad] of a beam on the map.
double angle_of(const mrpt::math::TPose2D& pose, double field_of_view, std::size_t beam)
{
	return pose.phi + (static_cast<double>(beam) - 0.5 * (field_of_view - 1)) * M_PI / 180;
}
}  // namespace

Grid altered(const Grid& floor, unsigned seed)
{
	Grid other = floor;
	std::mt19937 random(seed);
	const auto walls = static_cast<double>(std::count(floor.cells.begin(), floor.cells.end(), Cell::kOccupied));
	const int length = static_cast<int>(std::lround(1.5 / floor.cell_size));
	const auto below = [&](int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); };
	for (double changed = 0; changed < 0.05 * walls;)
	{
		const int x = below(floor.width), y = below(floor.height);
		const Cell from = random() % 2 == 0 ? Cell::kOccupied : Cell::kFree;
		if (floor.at(x, y) != from) continue;
		const bool is_upright = random() % 2 == 0;
		const int width = is_upright ? 3 : length, height = is_upright ? length : 3;
		for (int v = y; v < std::min(floor.height, y + height); v++)
			for (int u = x; u < std::min(floor.width, x + width); u++)
			{
				if (floor.at(u, v) != from) continue;
				other.cells[static_cast<std::size_t>(floor.index(u, v))] =
				    from == Cell::kOccupied ? Cell::kFree : Cell::kOccupied;
				changed += 1;
			}
	}
	return other;
}

std::shared_ptr<const OccupancyMap> map_of(const Grid& grid)
{
	std::vector<float> p_occupied;
	for (const Cell cell : grid.cells)
		p_occupied.push_back(cell == Cell::kFree ? 0.01F : cell == Cell::kOccupied ? 0.99F : NAN);
	return map_of_cells(
	    p_occupied, static_cast<std::size_t>(grid.width), {grid.cell_size, grid.origin_x, grid.origin_y});
}

bool is_open(const Grid& grid, int column, int row)
{
	for (int y = row - 6; y <= row + 6; y++)
		for (int x = column - 6; x <= column + 6; x++)
			if (!grid.contains(x, y) || grid.at(x, y) != Cell::kFree) return false;
	return true;
}

mrpt::math::TPose2D open_pose_on(const Grid& grid, std::mt19937& random)
{
	std::uniform_real_distribution<double> unit(0, 1);
	for (;;)
	{
		const mrpt::math::TPose2D pose{
		    grid.origin_x + unit(random) * grid.width * grid.cell_size,
		    grid.origin_y + unit(random) * grid.height * grid.cell_size, M_PI * (2 * unit(random) - 1)};
		if (is_open(
		        grid, static_cast<int>((pose.x - grid.origin_x) / grid.cell_size),
		        static_cast<int>((pose.y - grid.origin_y) / grid.cell_size)))
			return pose;
	}
}

mrpt::obs::CObservation2DRangeScan::Ptr scan_of(
    const RayCaster& caster, const mrpt::math::TPose2D& pose, double field_of_view, std::mt19937& random)
{
	std::normal_distribution<double> noise(0, 0.01);  // [m]
	auto scan = mrpt::obs::CObservation2DRangeScan::Create();
	const auto beams = static_cast<std::size_t>(field_of_view);
	scan->aperture = static_cast<float>((field_of_view - 1) * M_PI / 180);
	scan->rightToLeft = true;
	scan->maxRange = static_cast<float>(kReach);
	scan->resizeScan(beams);
	for (std::size_t i = 0; i < beams; i++)
	{
		const auto range = caster.cast(pose.x, pose.y, angle_of(pose, field_of_view, i));
		scan->setScanRange(i, static_cast<float>(range + noise(random)));
		scan->setScanRangeValidity(i, static_cast<double>(range) < kReach);
	}
	return scan;
}

bool look_alike(const Grid& a, const Grid& b, const mrpt::math::TPose2D& pose, double field_of_view)
{
	constexpr double kDifferent = 0.1, kMostBeams = 0.05;  // [m], [-]
	const RayCaster in_a(a, kReach), in_b(b, kReach);
	const auto beams = static_cast<std::size_t>(field_of_view);
	int different = 0;
	for (std::size_t i = 0; i < beams; i++)
	{
		const double angle = angle_of(pose, field_of_view, i);
		const float difference = in_a.cast(pose.x, pose.y, angle) - in_b.cast(pose.x, pose.y, angle);
		different += std::abs(static_cast<double>(difference)) > kDifferent ? 1 : 0;
	}
	return different < kMostBeams * static_cast<double>(beams);
}
}  // namespace d2s1r::experiments
