// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "fine/piece_shifts.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>

namespace d2s1r
{
PieceShifts::PieceShifts(const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor)
    : field_(field), returns_(returns), sensor_(sensor.x, sensor.y)
{
	const double c = std::cos(sensor.phi), s = std::sin(sensor.phi);
	heading_ << c, -s, s, c;
}

double PieceShifts::cost_of(std::size_t first, std::size_t past, double most)
{
	constexpr double kAlike = 5;       // [m] of way, over which the correlation of shifts falls to 1 / e
	constexpr double kOfMean = 0.05;   // [m] a cell: standard deviation of a piece that is where the map has it
	constexpr double kOfShape = 0.10;  // [m] root mean square of the distances of a piece of another shape
	const Piece piece = piece_of(first, past);
	const double kept = last_ ? std::exp(-(piece.middle - *last_).norm() / kAlike) : 1;
	const Eigen::Vector2d shift = kept * shift_;
	const Eigen::Matrix2d covariance = kept * kept * covariance_ + (1 - kept * kept) * prior_covariance();
	const Eigen::Vector2d across = covariance * piece.normal;
	const double variance = piece.normal.dot(across) + mrpt::square(kOfMean);
	const double surprise = piece.off - piece.normal.dot(shift);
	const double cost = mrpt::square(surprise) / (2 * variance) + piece.variance / (2 * mrpt::square(kOfShape));
	if (cost > most) return most;
	last_ = piece.middle;
	shift_ = shift + across * (surprise / variance);
	covariance_ = covariance - across * across.transpose() / variance;
	return cost;
}

Eigen::Vector2d PieceShifts::end_of(std::size_t i) const
{
	return heading_ * Eigen::Vector2d(returns_.unit_x[i], returns_.unit_y[i]) * returns_.range[i];
}

/// Returns the normal of the straight line from the first return to the last one; that of few is their direction.
Eigen::Vector2d PieceShifts::normal_of(std::size_t first, std::size_t past) const
{
	constexpr std::size_t kFew = 2;     // [-] returns
	constexpr double kShortest = 0.05;  // [m] of a line
	const Eigen::Vector2d along = end_of(past - 1) - end_of(first);
	if (past - first <= kFew || along.norm() < kShortest) return end_of(first).normalized();
	return Eigen::Vector2d(-along.y(), along.x()).normalized();
}

PieceShifts::Piece PieceShifts::piece_of(std::size_t first, std::size_t past) const
{
	constexpr double kLeastSlope = 1e-3;  // [-] on a wall the distance has no direction
	Piece piece{Eigen::Vector2d::Zero(), normal_of(first, past)};
	double squares = 0;  // [m^2]
	for (std::size_t i = first; i < past; i++)
	{
		const Eigen::Vector2d end = end_of(i);
		const Distance at = field_.at(sensor_.x() + end.x(), sensor_.y() + end.y());
		const double distance = std::min(kFarthestShift, static_cast<double>(at.value));
		const Eigen::Vector2d slope(at.gradient_x, at.gradient_y);
		const double steepness = slope.norm();
		if (steepness > kLeastSlope) piece.off += distance * slope.dot(piece.normal) / steepness;
		squares += mrpt::square(distance);
		piece.middle += end;
	}
	const auto count = static_cast<double>(past - first);
	piece.middle /= count;
	piece.off /= count;
	piece.variance = std::max(0.0, squares / count - mrpt::square(piece.off));
	return piece;
}
}  // namespace d2s1r
