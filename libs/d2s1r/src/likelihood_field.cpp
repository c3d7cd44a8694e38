// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/likelihood_field.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace d2s1r
{
namespace
{
/// Squared Euclidean distance [cells^2] along one line, to the least of value[j] + (i - j)^2 with |i - j| <= reach.
void spread_along_line(std::vector<float>& value, std::vector<float>& scratch, int reach)
{
	const int n = static_cast<int>(value.size());
	scratch.assign(value.begin(), value.end());
	for (int i = 0; i < n; i++)
		for (int j = std::max(0, i - reach); j <= std::min(n - 1, i + reach); j++)
		{
			const auto step = static_cast<float>(i - j);
			auto& best = value[static_cast<std::size_t>(i)];
			best = std::min(best, scratch[static_cast<std::size_t>(j)] + step * step);
		}
}

/// Squared distance [cells^2] of every cell to the nearest occupied one, exact up to `reach` cells.
std::vector<float> squared_distances(const Grid& grid, int reach)
{
	const auto far = static_cast<float>(2 * (reach + 1) * (reach + 1));
	std::vector<float> squared(grid.cells.size());
	for (std::size_t i = 0; i < squared.size(); i++) squared[i] = grid.cells[i] == Cell::kOccupied ? 0.0F : far;

	const auto spread = [&](int lines, int length, auto&& at)
	{
		std::vector<float> line(static_cast<std::size_t>(length)), scratch;
		for (int l = 0; l < lines; l++)
		{
			for (int i = 0; i < length; i++) line[static_cast<std::size_t>(i)] = at(l, i);
			spread_along_line(line, scratch, reach);
			for (int i = 0; i < length; i++) at(l, i) = line[static_cast<std::size_t>(i)];
		}
	};
	const auto cell = [&](int column, int row) -> float&
	{ return squared[static_cast<std::size_t>(grid.index(column, row))]; };
	spread(grid.height, grid.width, [&](int row, int column) -> float& { return cell(column, row); });
	spread(grid.width, grid.height, [&](int column, int row) -> float& { return cell(column, row); });
	return squared;
}
}  // namespace

std::vector<mrpt::math::TPoint2Df> end_points(const Scan& scan, int most)
{
	std::vector<mrpt::math::TPoint2Df> points;
	for (const Beam& beam : scan.beams)
	{
		if (!beam.is_return) continue;
		const auto range = static_cast<double>(beam.range);
		const auto angle = static_cast<double>(beam.angle);
		const auto point = scan.sensor_on_robot.composePoint({range * std::cos(angle), range * std::sin(angle)});
		points.emplace_back(static_cast<float>(point.x), static_cast<float>(point.y));
	}
	const std::size_t count = points.size();
	const std::size_t kept = std::min(count, static_cast<std::size_t>(most));
	for (std::size_t i = 0; i < kept; i++) points[i] = points[i * count / kept];
	points.resize(kept);
	return points;
}

LikelihoodField::LikelihoodField(const Grid& grid, const LikelihoodParameters& parameters)
    : width_(grid.width),
      height_(grid.height),
      cell_size_(grid.cell_size),
      origin_x_(grid.origin_x),
      origin_y_(grid.origin_y),
      independent_beams_(parameters.independent_beams)
{
	// relative to the density on a wall; beyond three sigma only random_share is left
	const int reach = static_cast<int>(std::ceil(3 * parameters.sigma / cell_size_));
	const double per_squared_cell = cell_size_ * cell_size_ / (2 * parameters.sigma * parameters.sigma);
	const auto squared = squared_distances(grid, reach);
	log_outside_ = static_cast<float>(std::log(parameters.random_share));
	log_table_.resize(squared.size());
	for (std::size_t i = 0; i < squared.size(); i++)
	{
		const double hit = std::exp(-static_cast<double>(squared[i]) * per_squared_cell);
		const double unknown = grid.cells[i] == Cell::kUnknown ? parameters.unknown_share : 0.0;
		const double known = parameters.random_share + (1 - parameters.random_share) * hit;
		log_table_[i] = static_cast<float>(std::log(std::max(known, unknown)));
	}
}

double LikelihoodField::log_likelihood(
    const std::vector<mrpt::math::TPoint2Df>& points, const mrpt::math::TPose2D& robot) const
{
	if (points.empty()) return 0.0;
	const auto c = static_cast<float>(std::cos(robot.phi) / cell_size_);
	const auto s = static_cast<float>(std::sin(robot.phi) / cell_size_);
	const auto x0 = static_cast<float>((robot.x - origin_x_) / cell_size_);
	const auto y0 = static_cast<float>((robot.y - origin_y_) / cell_size_);
	float sum = 0;
	for (const auto& point : points)
	{
		const float x = x0 + c * point.x - s * point.y;
		const float y = y0 + s * point.x + c * point.y;
		const bool inside = x >= 0 && y >= 0 && x < static_cast<float>(width_) && y < static_cast<float>(height_);
		sum += inside ? log_table_[static_cast<std::size_t>(static_cast<int>(y) * width_ + static_cast<int>(x))]
		              : log_outside_;
	}
	const auto n = static_cast<double>(points.size());
	return static_cast<double>(sum) * std::min(1.0, independent_beams_ / n);
}
}  // namespace d2s1r
