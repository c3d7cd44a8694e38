// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>
#include <d2s1r/scan.h>
#include <mrpt/math/TPoint2D.h>
#include <mrpt/math/TPose2D.h>

namespace d2s1r
{
class DistanceField;

/// Where the beams of `scan` that returned end [m, robot frame]; at most `most` of them, evenly spread over the beams.
std::vector<mrpt::math::TPoint2Df> end_points(const Scan& scan, int most);

/// How likely beams end where they do, one table look-up a beam: for particle filters, which ask for a thousand poses
/// a scan. The likelihood field model (Thrun, Burgard and Fox, Probabilistic Robotics, Section 6.4). Const and
/// thread-safe.
class LikelihoodField
{
   public:
	/// \throws std::invalid_argument if a parameter is out of range, or the grid has too many cells for a DistanceField
	LikelihoodField(const Grid& grid, const LikelihoodParameters& parameters);

	/// Log-likelihood [nat] of beams that end at `points` [m, robot frame] if the robot is at `robot` (in map); finite,
	/// zero for no points. The sum over the beams is scaled to parameters.independent_beams.
	double log_likelihood(const std::vector<mrpt::math::TPoint2Df>& points, const mrpt::math::TPose2D& robot) const;

   private:
	LikelihoodField(const Grid& grid, const DistanceField& field, const LikelihoodParameters& parameters);

	int width_, height_;  //!< [cells] of the grid and a rim about it: the outer walls of a building are its edge
	double cell_size_, origin_x_, origin_y_;
	double independent_beams_;
	float log_outside_;             //!< [nat] of an end outside of both
	std::vector<float> log_table_;  //!< [nat] of an end in each cell
};
}  // namespace d2s1r
