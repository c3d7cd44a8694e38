// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A drawn floor whose places all look different, and what tests of the default method need on it.
#pragma once

#include <d2s1r/scan.h>
#include <mrpt/math/wrap2pi.h>

#include "test_maps.h"

namespace d2s1r::test
{
inline constexpr double kDegree = M_PI / 180;

/// Walls as a laser maps them: of what is occupied only the cells beside a free one, the rest is unknown.
inline Grid with_thin_walls(const Grid& grid)
{
	Grid thin = grid;
	for (int y = 0; y < grid.height; y++)
		for (int x = 0; x < grid.width; x++)
		{
			bool seen = false;
			for (int v = y - 1; v <= y + 1; v++)
				for (int u = x - 1; u <= x + 1; u++) seen |= grid.contains(u, v) && grid.at(u, v) == Cell::kFree;
			if (!seen) thin.cells[static_cast<std::size_t>(grid.index(x, y))] = Cell::kUnknown;
		}
	return thin;
}

/// Each character of `picture` as 0.5 x 0.5 m in cells of 5 cm.
inline Grid make_building(const Picture& picture, double origin_x = 0, double origin_y = 0)
{
	return with_thin_walls(make_picture_grid(enlarge(picture, 10), 0.05, origin_x, origin_y));
}

/// What was mapped: the surfaces of its walls lie in the middle of the map's occupied cells, as those of a map drawn
/// from scans do on average, and all that is behind them is solid.
inline Grid world_of(const Grid& map)
{
	const auto is_free = [&](int x, int y)
	{ return map.contains(x >> 1, y >> 1) && map.at(x >> 1, y >> 1) == Cell::kFree; };
	Grid world{2 * map.width, 2 * map.height, 0.5 * map.cell_size, map.origin_x, map.origin_y, {}};
	for (int y = 0; y < world.height; y++)
		for (int x = 0; x < world.width; x++)
		{
			bool open = false;
			for (int v = y - 1; v <= y + 1; v++)
				for (int u = x - 1; u <= x + 1; u++) open |= is_free(u, v);
			world.cells.push_back(open ? Cell::kFree : Cell::kOccupied);
		}
	return world;
}

/// 14 x 8 m of offices on a corridor; lower left corner at (-3, 2) m.
inline Grid make_floor()
{
	return make_building(
	    {"############################",  //
	     "#......#.........#...#.....#",  //
	     "#......#.........#...#.....#",  //
	     "#......#...##....#...#.....#",  //
	     "#................#...#..#..#",  //
	     "#......#.........#.........#",  //
	     "###.#########..#####.####..#",  //
	     "#.......................#..#",  //
	     "#.......................#..#",  //
	     "#####.####.#########.####..#",  //
	     "#.......#....#......#......#",  //
	     "#.......#....#.........#...#",  //
	     "#..#....#....#......#......#",  //
	     "#.......#....#......#......#",  //
	     "#............#......#......#",  //
	     "############################"},
	    -3, 2);
}

/// A floor and, beside it, its copy turned by 180 deg, at another offset from the squares of the samples.
inline Grid with_turned_copy(const Grid& floor)
{
	constexpr int kApart = 40, kShift = 13;  // [cells]
	Grid both{2 * floor.width + kApart + kShift, floor.height + kShift, floor.cell_size, 0, 0, {}};
	both.cells.assign(static_cast<std::size_t>(both.width) * static_cast<std::size_t>(both.height), Cell::kUnknown);
	for (int y = 0; y < floor.height; y++)
		for (int x = 0; x < floor.width; x++)
			for (const int at : {both.index(x, y), both.index(both.width - 1 - x, both.height - 1 - y)})
				both.cells[static_cast<std::size_t>(at)] = floor.at(x, y);
	return both;
}

/// Robots all over make_floor(), map frame.
inline std::vector<mrpt::math::TPose2D> poses_on_floor()
{
	return {{-1.3, 8.1, 0.3}, {1.8, 8.9, -2.0}, {6.7, 8.2, 1.2},  {10.2, 8.7, 2.9},
	        {4.1, 6.1, 0.1},  {0.2, 3.2, -1.1}, {5.1, 4.3, -2.7}, {7.6, 3.6, 0.8}};
}

/// A laser that looks `field_of_view` [deg] around, a beam a degree.
inline Laser laser_of(int field_of_view)
{
	Laser laser;
	laser.beams = static_cast<std::size_t>(field_of_view);
	laser.aperture = (field_of_view - 1) * kDegree;
	return laser;
}

inline Scan scan_at(const Grid& grid, const mrpt::math::TPose2D& robot, const Laser& laser = {})
{
	return make_scan(make_observation(grid, robot, laser), {});
}

/// People: `count` beams from the `first` one on end at most `range` [m] away.
inline void block(Scan& scan, std::size_t first, std::size_t count, float range)
{
	for (std::size_t i = first; i < first + count; i++)
	{
		Beam& beam = scan.beams[i % scan.beams.size()];
		beam.range = std::min(beam.range, range);
		beam.is_return = true;
	}
}

inline double distance_between(const mrpt::math::TPose2D& a, const mrpt::math::TPose2D& b)
{
	return std::hypot(a.x - b.x, a.y - b.y);
}

/// [deg]
inline double turn_between(const mrpt::math::TPose2D& a, const mrpt::math::TPose2D& b)
{
	return std::abs(mrpt::math::wrapToPi(a.phi - b.phi)) / kDegree;
}

/// Poses in free cells of `grid`, at least `clearance` [m] from its walls, each with any heading.
inline std::vector<mrpt::math::TPose2D> random_poses(const Grid& grid, int count, double clearance, unsigned seed)
{
	std::mt19937 generator(seed);
	std::uniform_real_distribution<double> unit(0, 1);
	const auto stands = [&](const mrpt::math::TPose2D& pose)
	{
		const int reach = static_cast<int>(clearance / grid.cell_size);
		const int column = static_cast<int>((pose.x - grid.origin_x) / grid.cell_size);
		const int row = static_cast<int>((pose.y - grid.origin_y) / grid.cell_size);
		for (int y = row - reach; y <= row + reach; y++)
			for (int x = column - reach; x <= column + reach; x++)
				if (!grid.contains(x, y) || grid.at(x, y) != Cell::kFree) return false;
		return true;
	};
	std::vector<mrpt::math::TPose2D> poses;
	while (poses.size() < static_cast<std::size_t>(count))
	{
		const mrpt::math::TPose2D pose{
		    grid.origin_x + unit(generator) * grid.width * grid.cell_size,
		    grid.origin_y + unit(generator) * grid.height * grid.cell_size, M_PI * (2 * unit(generator) - 1)};
		if (stands(pose)) poses.push_back(pose);
	}
	return poses;
}
}  // namespace d2s1r::test
