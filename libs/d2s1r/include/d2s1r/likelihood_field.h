// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>
#include <d2s1r/scan.h>
#include <mrpt/math/TPoint2D.h>
#include <mrpt/math/TPose2D.h>

namespace d2s1r
{
/// End-point beam model of LikelihoodField.
struct LikelihoodParameters
{
	double sigma = 0.10;              //!< [m] of end points about the surface of a wall
	double random_share = 0.10;       //!< [0, 1] of the beams that end anywhere (people, moved things)
	double unknown_share = 0.30;      //!< [0, 1] density of an end in unknown space, relative to one on a wall
	int beams = 90;                   //!< [-] most beams looked at, evenly spread over the scan
	double independent_beams = 20.0;  //!< [-] beams that a scan is worth: neighbours see the same object
};

/// Calls `visit(key, value, least, greatest, unit_and_meaning)` for every parameter. The one list that reading, writing
/// and checking go by; `P` is LikelihoodParameters, const or derived from it.
template <class P, class Visitor>
void visit_likelihood(P& p, Visitor&& visit)
{
	visit("sigma", p.sigma, 0.001, 10.0, "[m] of end points about the surface of a wall");
	visit("random_share", p.random_share, 1e-6, 1.0, "[0, 1] of the beams that end anywhere");
	visit("unknown_share", p.unknown_share, 0.0, 1.0, "[0, 1] density of an end in unknown space");
	visit("beams", p.beams, 2, 100000, "[-] most beams looked at");
	visit("independent_beams", p.independent_beams, 0.1, 1e5, "[-] beams that a scan is worth");
}

/// \throws std::invalid_argument naming the first parameter out of range
void check(const LikelihoodParameters& parameters);

/// Where the beams of `scan` that returned end [m, robot frame]; at most `most` of them, evenly spread over the beams.
std::vector<mrpt::math::TPoint2Df> end_points(const Scan& scan, int most);

/// How likely beams end where they do, one table look-up a beam: for particle filters, which ask for a thousand poses
/// a scan. The likelihood field model (Thrun, Burgard and Fox, Probabilistic Robotics, Section 6.4). Const and
/// thread-safe.
class LikelihoodField
{
   public:
	/// \throws std::invalid_argument if a parameter is out of range
	LikelihoodField(const Grid& grid, const LikelihoodParameters& parameters);

	/// Log-likelihood [nat] of beams that end at `points` [m, robot frame] if the robot is at `robot` (in map); finite,
	/// zero for no points. The sum over the beams is scaled to parameters.independent_beams.
	double log_likelihood(const std::vector<mrpt::math::TPoint2Df>& points, const mrpt::math::TPose2D& robot) const;

   private:
	int width_, height_;
	double cell_size_, origin_x_, origin_y_;
	double independent_beams_;
	float log_outside_;             //!< [nat] of an end outside of the grid
	std::vector<float> log_table_;  //!< [nat] of an end in each cell
};
}  // namespace d2s1r
