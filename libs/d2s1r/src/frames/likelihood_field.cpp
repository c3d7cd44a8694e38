// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/likelihood_field.h>

#include <algorithm>
#include <cmath>

#include "ranges/distance_field.h"

namespace d2s1r
{
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
    : LikelihoodField(grid, DistanceField(grid), parameters)
{
}

LikelihoodField::LikelihoodField(const Grid& grid, const DistanceField& field, const LikelihoodParameters& parameters)
    : width_(field.width()),
      height_(field.height()),
      cell_size_(field.cell_size()),
      origin_x_(field.origin_x()),
      origin_y_(field.origin_y()),
      independent_beams_(parameters.independent_beams)
{
	check(parameters);
	// The table holds densities relative to the one on a wall.
	const auto cell_at = [&, rim = (width_ - grid.width) / 2](int x, int y)
	{ return grid.contains(x - rim, y - rim) ? grid.at(x - rim, y - rim) : Cell::kUnknown; };
	log_table_.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
	for (int y = 0; y < height_; y++)
		for (int x = 0; x < width_; x++)
		{
			const std::uint8_t code = field.cells()[log_table_.size()];
			const double distance = cell_size_ * static_cast<double>(DistanceField::distance_of_code(code));
			const double hit = std::exp(-0.5 * distance * distance / (parameters.sigma * parameters.sigma));
			const double known = parameters.random_share + (1 - parameters.random_share) * hit;
			const double least = cell_at(x, y) == Cell::kUnknown ? parameters.unknown_share : 0.0;
			log_table_.push_back(static_cast<float>(std::log(std::max(known, least))));
		}
	log_outside_ = static_cast<float>(std::log(std::max(parameters.random_share, parameters.unknown_share)));
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
