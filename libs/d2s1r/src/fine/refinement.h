// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <d2s1r/parameters.h>

#include <cmath>

#include "coarse/coarse_search.h"
#include "fine/scoring.h"

namespace d2s1r
{
/// A pose moved to where the end points of the scan lie on walls.
struct RefinedPose : PoseInMap
{
	/// [-] Mean over all beams of the square root of the robust weight of their end points (Geman and McClure), which
	/// is 1 on a wall and 0 for a beam that saw nothing. settle() subtracts the weighted coarse cost.
	double fit = 0;
};

/// What is done to fewer and fewer poses, because each stage takes longer for a pose than the one before.
enum class Stage
{
	kScored,     //!< with up to 45 beams: settled candidates, those of best fit
	kRefined,    //!< with up to 180 beams: those of best score
	kRestarted,  //!< refined from both sides along what the scan leaves open: those of best fit
	kPolished,   //!< with up to 360 beams: those of best score
	kCompared    //!< by the best score within some centimetres: the best places
};

/// [nat] A pose whose score is so far below the best one's is given up.
inline constexpr double kHopeless = 21;

/// [nat] The same by the scores of a few beams, which are further apart for wrong poses. Chosen by hand on scans of
/// intel, mit_killian and mit_csail.
inline constexpr double kImplausible = 14;

/// [nat] The same by the pieces of surface that these beams show. A place that a bent map hides from the beams is found
/// by its pieces. Chosen by hand on look-alike buildings, intel and mit_csail.
inline constexpr double kImplausiblePieces = 4;

/// Returns the maximum number of poses [-] of a stage: parameters.max_scored, and a third each time, rounded up.
std::size_t most_poses(Stage stage, const RefinementParameters& parameters);

/// Pulls candidates onto the walls, in each reading of their maps: Gauss-Newton on the distance field with a robust
/// kernel that shrinks. Before each step, and after the last, poses that fit worse than the best by more than
/// parameters.fit_margin are dropped.
/// \param parameters have the numbers and margins for the poses in all maps together, as in all functions here that
///        take several poses; what is asked of a single pose is in the parameters of its map
/// \return distinct poses, best fit less the coarse cost first, as many as may be scored. Thread-safe, as all
///         functions here.
std::vector<RefinedPose> settle(
    const BeamSubset& few, const std::vector<Candidate>& candidates, const RefinementParameters& parameters);

/// Returns those of `poses` that a few beams find plausible, best score first: as many as may be refined, and none
/// whose score is below the best one's by more than kImplausible; then those that the pieces of surface find plausible,
/// by the ends of the beams. Beams are followed only where their ends leave a chance.
/// \param least [nat] score that a pose must reach
std::vector<RefinedPose> make_shortlist(
    const BeamSubset& few, const std::vector<RefinedPose>& poses, const RefinementParameters& parameters,
    double least = -HUGE_VAL);

/// Goes on with more beams, to the end. Gauss-Newton stops early in a corridor, and people pull it off: poses to both
/// sides of the best ones, along the direction that the scan leaves open, that fit better yet are returned as well.
/// Which of them is right is for the score to say, which knows what a beam passed.
/// \return distinct poses, best fit first
std::vector<RefinedPose> refine(
    const BeamSubset& many, std::vector<RefinedPose> poses, const RefinementParameters& parameters);

/// Moves a pose by the last few millimetres: Gauss-Newton over the pose and one offset of all ranges. The walls of a
/// map that was drawn from scans lie in the middle of their cells, those of a map that was drawn by hand at their near
/// side; the scan tells which.
mrpt::math::TPose2D polish(
    const DistanceField& field, const BeamSubset& beams, mrpt::math::TPose2D pose,
    const RefinementParameters& parameters);

/// Returns the covariance of the sensor's pose (x, y, phi) [m^2, m rad, rad^2], from the walls that the end points lie
/// on, and from how far along the direction that they leave open, and in yaw, the scan fits nearly as well. What they
/// leave open, such as the way along a corridor, is limited to 1 m and 10 deg.
Eigen::Matrix3d pose_covariance(
    const DistanceField& field, const BeamSubset& beams, const mrpt::math::TPose2D& sensor,
    const RefinementParameters& parameters);
}  // namespace d2s1r
