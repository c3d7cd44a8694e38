// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>
#include <d2s1r/scan.h>
#include <mrpt/math/TPoint2D.h>
#include <mrpt/math/TPose2D.h>

namespace d2s1r
{
class DistanceField;

/// Returns where the returns of `scan` end [m, robot frame]: at most `most` of them, evenly spread over the beams.
std::vector<mrpt::math::TPoint2Df> end_points(const Scan& scan, int most);

/// Tells how likely beams end where they do, by one table look-up a beam: for particle filters, which ask for a
/// thousand poses a scan. It is the likelihood field model (Thrun, Burgard and Fox, Probabilistic Robotics,
/// Section 6.4). Const and thread-safe.
class LikelihoodField
{
   public:
	/// Fills the table of `grid`.
	/// \throws std::invalid_argument if a parameter is out of range, or the grid, with a rim of 32 cells about it, has
	///         2^31 cells or more
	LikelihoodField(const Grid& grid, const LikelihoodParameters& parameters);

	/// Returns the log-likelihood [nat] of beams that end at `points` [m, robot frame] if the robot is at `robot` (in
	/// map): a finite number, and zero if there are no points. More points than parameters.independent_beams count as
	/// so many.
	double log_likelihood(const std::vector<mrpt::math::TPoint2Df>& points, const mrpt::math::TPose2D& robot) const;

   private:
	LikelihoodField(const Grid& grid, const DistanceField& field, const LikelihoodParameters& parameters);

	int width_, height_;  //!< [cells] of the grid and a rim about it: the outer walls of a building are its edge
	double cell_size_, origin_x_, origin_y_;  //!< [m] map frame
	double independent_beams_;                //!< [-]
	float log_outside_;                       //!< [nat] for a beam that ends outside of grid and rim
	std::vector<float> log_table_;            //!< [nat] by cell, for a beam that ends there
};
}  // namespace d2s1r
