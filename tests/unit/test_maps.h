// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Maps drawn as pictures, and scans of them by exact ray casting that shares no code with the library.
#pragma once

#include <d2s1r/grid.h>
#include <d2s1r/range_scan.h>
#include <mrpt/math/TPose2D.h>
#include <mrpt/poses/CPose2D.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace d2s1r::test
{
/// '#' occupied, '.' free, '?' unknown; lines of equal length, the first one has the greatest y.
using Picture = std::vector<std::string>;

inline Cell cell_of(char c)
{
	switch (c)
	{
		case '#':
			return Cell::kOccupied;
		case '.':
			return Cell::kFree;
		case '?':
			return Cell::kUnknown;
	}
	throw std::invalid_argument(std::string("test picture: unknown character ") + c);
}

/// The picture cell by cell, not cropped. \param origin_x, origin_y [m] of the lower left corner
inline Grid make_picture_grid(const Picture& picture, double cell_size, double origin_x = 0, double origin_y = 0)
{
	Grid grid;
	grid.width = static_cast<int>(picture.at(0).size());
	grid.height = static_cast<int>(picture.size());
	grid.cell_size = cell_size;
	grid.origin_x = origin_x;
	grid.origin_y = origin_y;
	for (auto line = picture.rbegin(); line != picture.rend(); ++line)
	{
		if (line->size() != picture[0].size()) throw std::invalid_argument("test picture: lines of different length");
		for (const char c : *line) grid.cells.push_back(cell_of(c));
	}
	return grid;
}

/// The grid as a map.
inline std::shared_ptr<OccupancyMap> make_map(const Grid& grid)
{
	const auto map = std::make_shared<OccupancyMap>(
	    unknown_map(grid.width, grid.height, grid.cell_size, grid.origin_x, grid.origin_y));
	for (std::size_t i = 0; i < grid.cells.size(); i++)
		if (const Cell cell = grid.cells[i]; cell != Cell::kUnknown)
			map->cells[i] = OccupancyMap::cell_of(cell == Cell::kFree ? 0.99F : 0.01F);
	return map;
}

inline std::shared_ptr<OccupancyMap> make_map(
    const Picture& picture, double cell_size, double origin_x = 0, double origin_y = 0)
{
	return make_map(make_picture_grid(picture, cell_size, origin_x, origin_y));
}

/// P(occupied) of a cell, to the resolution of its log-odds.
inline double p_occupied(const OccupancyMap& map, int x, int y)
{
	return 1.0 - static_cast<double>(map.p_free(x, y));
}

/// Each character of `picture` as factor x factor characters.
inline Picture enlarge(const Picture& picture, int factor)
{
	Picture large;
	for (const std::string& line : picture)
	{
		std::string wide;
		for (const char c : line) wide.append(static_cast<std::size_t>(factor), c);
		large.insert(large.end(), static_cast<std::size_t>(factor), wide);
	}
	return large;
}

/// Exact distance [m] from (x, y) [m, map frame] along `angle` [rad] to the first occupied cell, by the crossings of
/// the ray with grid lines in order; max_range if there is none. Unknown cells let the ray pass.
inline double cast_exactly(const Grid& grid, double x, double y, double angle, double max_range)
{
	const double u = (x - grid.origin_x) / grid.cell_size, v = (y - grid.origin_y) / grid.cell_size;  // [cells]
	const double dx = std::cos(angle), dy = std::sin(angle);
	int column = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
	const double far = 1e12;
	const double step_x = std::abs(dx) > 1e-12 ? 1 / std::abs(dx) : far;
	const double step_y = std::abs(dy) > 1e-12 ? 1 / std::abs(dy) : far;
	double next_x = (dx > 0 ? column + 1 - u : u - column) * step_x;
	double next_y = (dy > 0 ? row + 1 - v : v - row) * step_y;
	double distance = 0;  // [cells]
	while (distance * grid.cell_size < max_range)
	{
		if (grid.contains(column, row) && grid.at(column, row) == Cell::kOccupied) return distance * grid.cell_size;
		distance = std::min(next_x, next_y);
		if (next_x < next_y)
		{
			column += dx > 0 ? 1 : -1;
			next_x += step_x;
		}
		else
		{
			row += dy > 0 ? 1 : -1;
			next_y += step_y;
		}
	}
	return max_range;
}

/// A laser and how its scans are recorded.
struct Laser
{
	std::size_t beams = 360;  //!< [-]
	double aperture =
	    2 * M_PI * 359 / 360;  //!< [rad] between the first and the last beam; field of view of a full turn
	double max_range = 30;     //!< [m]
	double noise = 0;          //!< [m] standard deviation of a range
	unsigned seed = 1;
	bool clockwise = false;
	mrpt::poses::CPose3D on_robot;  //!< sensor in robot frame; upside down if its roll is pi
};

/// What the laser records at `robot` (map frame). Beams without a return are flagged invalid, with range max_range.
inline RangeScan make_observation(const Grid& grid, const mrpt::math::TPose2D& robot, const Laser& laser = {})
{
	RangeScan observation;
	observation.aperture = static_cast<float>(laser.aperture);
	observation.right_to_left = !laser.clockwise;
	observation.max_range = static_cast<float>(laser.max_range);
	observation.sensor_on_robot = laser.on_robot;
	std::mt19937 generator(laser.seed);
	std::normal_distribution<double> error(0, laser.noise > 0 ? laser.noise : 1);
	const auto sensor = mrpt::poses::CPose3D(mrpt::poses::CPose2D(robot)) + laser.on_robot;
	for (std::size_t i = 0; i < laser.beams; i++)
	{
		const double turn = -0.5 * laser.aperture + laser.aperture * static_cast<double>(i) /
		                                                static_cast<double>(std::max<std::size_t>(laser.beams, 2) - 1);
		const double in_sensor = laser.clockwise ? -turn : turn;
		const auto ahead = sensor.rotateVector({std::cos(in_sensor), std::sin(in_sensor), 0.0});
		double range = cast_exactly(grid, sensor.x(), sensor.y(), std::atan2(ahead.y, ahead.x), laser.max_range);
		const bool is_return = range < laser.max_range;
		if (is_return && laser.noise > 0) range = std::clamp(range + error(generator), 1e-3, laser.max_range - 1e-3);
		observation.ranges.push_back(static_cast<float>(range));
		observation.valid.push_back(is_return ? 1 : 0);
	}
	return observation;
}
}  // namespace d2s1r::test
