// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/scoring.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace d2s1r
{
namespace
{
/// What a beam passed before it ended.
struct Passed
{
	int walls = 0;       //!< runs of occupied cells that lie behind it
	double unknown = 0;  //!< [m]
};

/// Exact traversal (Amanatides and Woo, 1987) from the sensor to the end of the beam.
Passed trace(const Grid& grid, double x, double y, double angle, double range)
{
	constexpr double kNever = std::numeric_limits<double>::infinity();
	constexpr double kAtWall = 0.15;  //!< [m] a wall this near to the end is where the beam ended
	const double column = (x - grid.origin_x) / grid.cell_size, row = (y - grid.origin_y) / grid.cell_size;
	const double dx = std::cos(angle), dy = std::sin(angle);
	const double end = range / grid.cell_size, passed_before = end - kAtWall / grid.cell_size;
	int i = static_cast<int>(std::floor(column)), j = static_cast<int>(std::floor(row));
	const int step_i = dx > 0 ? 1 : -1, step_j = dy > 0 ? 1 : -1;
	const double per_i = dx != 0 ? 1 / std::abs(dx) : kNever, per_j = dy != 0 ? 1 / std::abs(dy) : kNever;
	double next_i = dx != 0 ? (dx > 0 ? i + 1 - column : column - i) * per_i : kNever;
	double next_j = dy != 0 ? (dy > 0 ? j + 1 - row : row - j) * per_j : kNever;

	Passed passed;
	bool in_wall = false;
	for (double t = 0; t < end;)
	{
		if (!grid.contains(i, j))
		{
			passed.unknown += end - t;
			break;
		}
		const double next = std::min(next_i, next_j);
		const Cell cell = grid.at(i, j);
		if (cell == Cell::kUnknown) passed.unknown += std::min(next, end) - t;
		if (in_wall && cell != Cell::kOccupied && t < passed_before) passed.walls++;
		in_wall = cell == Cell::kOccupied;
		t = next;
		if (next_i < next_j)
			i += step_i, next_i += per_i;
		else
			j += step_j, next_j += per_j;
	}
	passed.unknown *= grid.cell_size;
	return passed;
}

enum class End
{
	kWall,
	kOffWall,
	kUnknown
};

struct EndScore
{
	double log_likelihood;
	End end;
};

EndScore score_end(double distance, bool in_unknown, const BeamModel& model)
{
	if (distance < 0.02) return {model.wall_2cm, End::kWall};
	if (distance < 0.04) return {model.wall_4cm, End::kWall};
	if (distance < 0.06) return {model.wall_6cm, End::kWall};
	if (distance < 0.10) return {model.wall_10cm, End::kWall};
	if (in_unknown) return {model.in_unknown, End::kUnknown};
	if (distance < 0.15) return {model.wall_15cm, End::kWall};
	if (distance < 0.20) return {model.wall_20cm, End::kOffWall};
	if (distance < 0.40) return {model.wall_40cm, End::kOffWall};
	return {model.in_free, End::kOffWall};
}

bool is_unknown(const Grid& grid, double x, double y)
{
	const int i = static_cast<int>(std::floor((x - grid.origin_x) / grid.cell_size));
	const int j = static_cast<int>(std::floor((y - grid.origin_y) / grid.cell_size));
	return !grid.contains(i, j) || grid.at(i, j) == Cell::kUnknown;
}
}  // namespace

Score score(
    const Grid& grid, const DistanceField& field, const Scan& scan, const mrpt::math::TPose2D& sensor,
    const BeamModel& model)
{
	constexpr double kBeam = M_PI / 180;  //!< [rad] the model's beam
	constexpr int kMostWalls = 3;
	constexpr double kMostUnknown = 3.0;  //!< [m]
	const double spacing = scan.field_of_view / static_cast<double>(scan.beams.size());
	const auto stride = static_cast<std::size_t>(std::max(1L, std::lround(kBeam / spacing)));

	Score result;
	bool was_off_wall = true, was_through_wall = true;
	int returns = 0, explained = 0;
	for (std::size_t b = 0; b < scan.beams.size(); b += stride)
	{
		const Beam& beam = scan.beams[b];
		bool off_wall = false, through_wall = false;
		if (beam.is_return)
		{
			const auto range = static_cast<double>(beam.range);
			const double angle = sensor.phi + static_cast<double>(beam.angle);
			const double x = sensor.x + range * std::cos(angle), y = sensor.y + range * std::sin(angle);
			const auto distance = static_cast<double>(field.at(x, y).value);
			const EndScore at_end = score_end(distance, distance >= 0.10 && is_unknown(grid, x, y), model);
			const Passed passed = trace(grid, sensor.x, sensor.y, angle, range);
			off_wall = at_end.end != End::kWall;
			through_wall = passed.walls > 0;
			result.log_likelihood += at_end.log_likelihood + model.through_wall * std::min(passed.walls, kMostWalls) +
			                         model.unknown_metre * std::min(passed.unknown, kMostUnknown);
			returns++;
			explained += !off_wall && !through_wall ? 1 : 0;
		}
		if (off_wall && !was_off_wall) result.log_likelihood += model.off_wall_run;
		if (through_wall && !was_through_wall) result.log_likelihood += model.through_wall_run;
		was_off_wall = off_wall;
		was_through_wall = through_wall;
	}
	result.log_likelihood *= spacing * static_cast<double>(stride) / kBeam;
	if (returns > 0) result.explained = static_cast<double>(explained) / returns;
	return result;
}
}  // namespace d2s1r
