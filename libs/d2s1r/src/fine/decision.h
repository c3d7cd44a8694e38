// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>

#include <cmath>
#include <optional>
#include <vector>

#include "fine/refinement.h"
#include "fine/scoring.h"

namespace d2s1r
{
/// The best pose found at a place of a map.
struct Place : PoseInMap
{
	Score score;                    //!< the best that was found at this place
	mrpt::math::TPose2D scored_at;  //!< sensor in map, m and rad: where it was found, some centimetres beside
	/// [nat] there, by the pieces of surface: see log_likelihood_by_pieces(); none: not asked yet
	std::optional<double> by_pieces = {};
	bool is_polished = false;  //!< whether the pose has been moved by the last few millimetres
	bool is_compared = false;  //!< whether that is the best within some centimetres
	double weight = 0;         //!< [0, 1] likelihood relative to the best place, tempered
	/// Of pose (x, y, phi) [m^2, m rad, rad^2]; add_covariances() sets it for the places that may be listed.
	Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// Scores refined poses with all beams and keeps the best of each place. Poses that may be the best one are polished
/// before the poses of a place are reduced to the best of them, and a place counts by the best score found at it:
/// otherwise a few centimetres would decide. Poses that the prior of their map rules out do not count. Poses are scored
/// by the beam model of their own map: log-likelihoods are all against beams that end anywhere, so that they share one
/// scale. Thread-safe.
/// \param limits have the numbers for all maps together
/// \param known places in the same maps that were found before, and that compete with the new ones
/// \return the places, best first
std::vector<Place> find_places(
    const Scan& scan, const BeamSubset& all, const std::vector<RefinedPose>& poses, const Parameters& limits,
    const std::vector<Place>& known = {});

/// Gives covariances to the best places, as many as an answer may list. It takes long, so it is done once, at the end.
/// \param all the beams that the places were found with
void add_covariances(const BeamSubset& all, const ScoringParameters& limits, std::vector<Place>& places);

/// Lead over the second best place [-], as log-odds, beyond which a greater one counts no more.
inline constexpr double kMostLead = 12;

/// Returns the part of the log-odds of presence that is due to the lead of the best place over the second one.
double log_odds_of_lead(double lead, const PresenceModel& model);

/// An answer about one or several maps.
struct Decision
{
	Localization answer;            //!< status, confidence and hypotheses (robot in map), without names of maps
	std::vector<std::size_t> maps;  //!< [-] by hypothesis, the number of its map
	std::size_t best = 0;           //!< [-] number of the place that is the first hypothesis, if there is one
};

/// Says what the scan can tell. Thread-safe.
///
/// The probability of a place is the product of two: its share of the likelihood of all places, which is a soft maximum
/// of their scores, and the presence, which is the probability that one of them is right at all (PresenceModel, a
/// logistic regression). What is left is the probability that none of them is right. The soft maximum is tempered: the
/// more beams contradict the map at the best place, the more of a difference is chance. Both are learned by
/// experiments/learn.py, from scans in their own and in other buildings' maps.
///
/// With several maps, the odds of the presence are those of each map, by its own best place, in the mean over the
/// places: each counts by its share of the likelihood. So a place that is likely but that its map explains badly gives
/// way to one in a map that explains the scan, and the same place in two maps gets half of the probability in each. The
/// odds are divided by the square root of the number of maps: the more maps, the more places seem right by chance. The
/// root was chosen by hand, on generated floors.
///
/// The beams of a laser that is mounted upside down are in the wrong order. Such a scan often fits some place of a
/// building by chance, but its mirror image nearly always fits its own place better. So the hypothesis that the beams
/// are in the wrong order competes with the places.
/// \param places best first, of all maps; only the best one, and others that have a covariance, become hypotheses
/// \param maps by their numbers
/// \param mirrored [nat] log-likelihood of the mirrored scan where that fits best; -inf if nobody looked
Decision decide(
    const Scan& scan, const std::vector<Place>& places, const std::vector<SearchedMap>& maps,
    double mirrored = -HUGE_VAL);
}  // namespace d2s1r
