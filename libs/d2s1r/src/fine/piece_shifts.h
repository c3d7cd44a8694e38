// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <optional>

#include "ranges/distance_field.h"
#include "scan/beam_subset.h"

namespace d2s1r
{
/// [m] Standard deviation by which a map has a piece of surface off, along each axis.
inline constexpr double kPieceShift = 0.12;

/// [m] A return that is farther from the walls counts as this far: it sees no wall of the map.
inline constexpr double kFarthestShift = 0.3;

/// Finds how far off the map stand the pieces of surface that a scan shows, and what that costs. A map is bent: it has
/// neighbouring pieces off together, and pieces far apart each in its own way. So the shift (x, y) of a piece is that
/// of the piece before it, but for what the way between them adds: a stationary Gauss-Markov process along the scan. A
/// piece shows the part of its shift that is normal to it, and the price is the likelihood of that given the pieces
/// before, by a Kalman filter. Source: Sarkka, Bayesian Filtering and Smoothing, 2013, sections 4.3 and 12.3.
class PieceShifts
{
   public:
	/// The arguments must outlive the object. \param sensor in map, m and rad
	PieceShifts(const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor);

	/// Returns what it costs [nat] that the next piece, the returns `first` to before `past`, stands where it does.
	/// \param most [nat] beyond, the piece is no wall of the map, costs this, and tells nothing of the next ones
	double cost_of(std::size_t first, std::size_t past, double most);

   private:
	/// What the returns of a piece show.
	struct Piece
	{
		Eigen::Vector2d middle, normal;  //!< [m] from the sensor, [-]; both in the directions of the map
		double off = 0;                  //!< [m] mean distance from the walls along the normal
		double variance = 0;             //!< [m^2] of the distances: of another shape than the walls
	};

	Eigen::Vector2d end_of(std::size_t i) const;
	Eigen::Vector2d normal_of(std::size_t first, std::size_t past) const;
	Piece piece_of(std::size_t first, std::size_t past) const;

	const DistanceField& field_;
	const BeamArrays& returns_;
	Eigen::Vector2d sensor_;                           //!< [m] in map
	Eigen::Matrix2d heading_;                          //!< of the sensor
	std::optional<Eigen::Vector2d> last_;              //!< [m] middle of the piece that was taken last
	Eigen::Vector2d shift_ = Eigen::Vector2d::Zero();  //!< [m] of that piece
	Eigen::Matrix2d covariance_ = prior_covariance();  //!< [m^2]

	static Eigen::Matrix2d prior_covariance() { return kPieceShift * kPieceShift * Eigen::Matrix2d::Identity(); }
};
}  // namespace d2s1r
