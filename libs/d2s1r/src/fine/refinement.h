// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "coarse/coarse_search.h"
#include "fine/scoring.h"

namespace d2s1r
{
/// A pose moved to where the end points of the scan lie on walls.
struct RefinedPose
{
	mrpt::math::TPose2D pose;  //!< sensor in map, m and rad
	/// [-] mean over all beams of the square root of the robust weight of their end points (Geman and McClure): 1 on a
	/// wall, 0 for a beam that saw nothing; settle() subtracts parameters.cost_weight times the coarse cost
	double fit = 0;
};

/// Pulls candidates onto the walls: Gauss-Newton on the distance field with a robust kernel that shrinks. Before each
/// step, and after the last, those that fit worse than the best by more than parameters.fit_margin are given up.
/// \return distinct poses, best fit less the coarse cost first, at most parameters.max_scored. Thread-safe, as all
///         functions here.
std::vector<RefinedPose> settle(
    const DistanceField& field, const BeamSubset& few, const std::vector<Candidate>& candidates,
    const RefinementParameters& parameters);

/// The same, to the end and with more beams. Gauss-Newton stops early in a corridor, and people pull it off: poses
/// beside the best ones, along the direction that the scan leaves open, that fit better yet are returned as well. Which
/// of them is right is for the score to say, which knows what a beam passed through.
/// \return distinct poses, best fit first
std::vector<RefinedPose> refine(
    const DistanceField& field, const BeamSubset& beams, std::vector<RefinedPose> poses,
    const RefinementParameters& parameters);

/// The last few millimetres: Gauss-Newton over pose and one offset of all ranges. Walls in a map drawn from scans lie
/// in the middle of their cells, those of a map drawn by hand at the near side of them; the scan tells which.
mrpt::math::TPose2D polish(
    const DistanceField& field, const BeamSubset& beams, mrpt::math::TPose2D pose,
    const RefinementParameters& parameters);

/// Covariance of the sensor's pose (x, y, phi) [m^2, m rad, rad^2] from the walls that the end points lie on; what they
/// leave open, such as the way along a corridor, is limited to 1 m and 10 deg.
Eigen::Matrix3d pose_covariance(
    const DistanceField& field, const BeamSubset& beams, const mrpt::math::TPose2D& sensor,
    const RefinementParameters& parameters);
}  // namespace d2s1r
