// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Exhaustive search of the likelihood field.
#include <cmath>
#include <limits>
#include <memory>

#include "ranges/distance_field.h"
#include "rivals.h"

namespace d2s1r::rivals
{
namespace
{
constexpr double kSpacing = 0.15;   // [m] of positions, Probabilistic Robotics, Section 8.2
constexpr int kHeadings = 72;       // [-] of 5 deg, the same
constexpr std::size_t kBeams = 30;  // [-] AMCL's laser_max_beams
constexpr double kHit = 0.95;       // [-] AMCL's z_hit
constexpr double kRandom = 0.05;    // [-] AMCL's z_rand
constexpr double kDeviation = 0.2;  // [m] AMCL's sigma_hit
constexpr double kFarthest = 2;     // [m] AMCL's laser_likelihood_max_dist
constexpr double kRange = 30;       // [m] over which random readings spread

/// The logarithm of the likelihood of a return that ends in a cell, for all cells.
struct Field
{
	Grid grid;
	std::vector<float> log_likelihoods;  //!< [nat] by cell
	float outside = 0;                   //!< [nat] of a return that ends outside of the grid
	std::vector<CellIndex> positions;    //!< free cells, kSpacing apart
};

Field make_field(const Grid& grid)
{
	const DistanceField distances(grid);
	const auto log_likelihood = [](double distance)
	{
		const double hit = std::exp(-0.5 * std::pow(std::min(distance, kFarthest) / kDeviation, 2));
		return static_cast<float>(std::log(kHit * hit + kRandom / kRange));
	};
	Field field{grid, {}, log_likelihood(kFarthest), {}};
	const int step = std::max(1, static_cast<int>(std::lround(kSpacing / grid.cell_size)));
	for (int row = 0; row < grid.height; row++)
		for (int column = 0; column < grid.width; column++)
		{
			const CellIndex cell = grid.index(column, row);
			const auto distance = distances.at(grid.center_x(cell), grid.center_y(cell)).value;
			field.log_likelihoods.push_back(log_likelihood(static_cast<double>(distance)));
			if (row % step == 0 && column % step == 0 && grid.at(column, row) == Cell::kFree)
				field.positions.push_back(cell);
		}
	return field;
}

/// Log-likelihood [nat] of returns that end `offsets` away from a position [cells].
float score_at(const Field& field, CellIndex position, const std::vector<std::pair<int, int>>& offsets)
{
	const int column = position % field.grid.width, row = position / field.grid.width;
	float sum = 0;
	for (const auto& [dx, dy] : offsets)
		sum += field.grid.contains(column + dx, row + dy)
		           ? field.log_likelihoods[static_cast<std::size_t>(field.grid.index(column + dx, row + dy))]
		           : field.outside;
	return sum;
}

std::vector<std::pair<int, int>> turned(
    const std::vector<mrpt::math::TPoint2D>& points, double heading, double cell_size)
{
	std::vector<std::pair<int, int>> offsets;
	const double c = std::cos(heading), s = std::sin(heading);
	for (const auto& p : points)
		offsets.emplace_back(
		    std::lround((c * p.x - s * p.y) / cell_size), std::lround((s * p.x + c * p.y) / cell_size));
	return offsets;
}
}  // namespace

std::vector<mrpt::math::TPoint2D> returns_of(const Scan& scan)
{
	std::vector<mrpt::math::TPoint2D> points;
	for (const Beam& beam : scan.beams)
		if (beam.is_return)
		{
			const double angle = static_cast<double>(beam.angle), range = static_cast<double>(beam.range);
			points.emplace_back(range * std::cos(angle), range * std::sin(angle));
		}
	return points;
}

std::vector<mrpt::math::TPoint2D> thinned(const std::vector<mrpt::math::TPoint2D>& points, std::size_t most)
{
	if (points.size() <= most) return points;
	std::vector<mrpt::math::TPoint2D> left;
	for (std::size_t i = 0; i < most; i++) left.push_back(points[i * points.size() / most]);
	return left;
}

Rival exhaustive_search(const Grid& grid)
{
	const auto field = std::make_shared<const Field>(make_field(grid));
	return [field](const Scan& scan) -> std::optional<mrpt::math::TPose2D>
	{
		const auto points = thinned(returns_of(scan), kBeams);
		if (points.empty()) return std::nullopt;
		float best = -std::numeric_limits<float>::max();
		mrpt::math::TPose2D pose;
		for (int i = 0; i < kHeadings; i++)
		{
			const double heading = 2 * M_PI * i / kHeadings;
			const auto offsets = turned(points, heading, field->grid.cell_size);
			for (const CellIndex position : field->positions)
			{
				const float score = score_at(*field, position, offsets);
				if (score <= best) continue;
				best = score;
				pose = {field->grid.center_x(position), field->grid.center_y(position), heading};
			}
		}
		return pose;
	};
}
}  // namespace d2s1r::rivals
