// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ranges/beam_tracer.h"
#include "ranges/distance_field.h"
#include "scan/beam_subset.h"

namespace d2s1r
{
/// What the beam model says of a scan at a pose.
struct Score
{
	double log_likelihood = 0;  //!< [nat] against beams that end anywhere, higher is better
	double explained = 0;       //!< [0, 1] share of the returns that end at a wall without having passed one
	double returns = 0;         //!< [-] all returns, as beams of 1 deg
	double contradicted = 0;    //!< [-] of these, those that are not explained and end at no object in front of a wall
	double unknown_metres = 0;  //!< [m] of unknown space that these beams passed, at most three each
	int segments = 0;           //!< [-] segments of the scan with explained returns over 3 deg
};

/// Scores a scan at a pose by a beam model that looks at the whole beam: where it ends, how many walls it passed and
/// how much unknown space. Neighbouring beams see the same object, so it is runs of them that count if they end in
/// front of walls. A beam that saw nothing is charged for a wall of the map within its reach, and says nothing
/// otherwise. If the map explains both sides of a depth edge, that says more than the same number of beams along a
/// wall: a wall fits in many places, one thing in front of another in few.
///
/// The weights (BeamModel) are a conditional logit: they maximize the probability of the true pose among those that
/// CoarseSearch and refine() find, so that the soft maximum of log-likelihoods is a calibrated probability.
/// experiments/learn.py learns them. Thread-safe.
Score score(
    const BeamTracer& tracer, const DistanceField& field, const BeamSubset& beams, const mrpt::math::TPose2D& sensor,
    const BeamModel& model);

/// Returns the log-likelihood [nat] of a scan at a pose by the pieces of surface that it shows, 0 at most. A map is a
/// measurement, and the beams on one piece (a segment of the scan) are off together: a piece of n returns counts as
/// much as sqrt(8 n) of them, if n of 1 deg are more than eight. Its returns lose what those of a piece whose returns
/// all lie on walls would have had; but where they end, they lose no more than what it costs to have the piece off the
/// map by as much as they are (PieceShifts). Beams that saw nothing are one piece. Thread-safe.
double log_likelihood_by_pieces(
    const BeamTracer& tracer, const DistanceField& field, const BeamSubset& beams, const mrpt::math::TPose2D& sensor,
    const BeamModel& model);

/// A score, and where it was found.
struct ScoredPose
{
	mrpt::math::TPose2D pose;  //!< sensor in map, m and rad
	Score score;
};

/// Returns the best score found at `sensor` and within some centimetres of it: a compass search (Kolda, Lewis and
/// Torczon, "Optimization by Direct Search", 2003), for scores have steps and no slope. Thread-safe.
ScoredPose best_score_near(
    const BeamTracer& tracer, const DistanceField& field, const BeamSubset& beams, const mrpt::math::TPose2D& sensor,
    const BeamModel& model);

/// Returns what the log-likelihood [nat] of score() cannot exceed at any pose in any map.
double greatest_log_likelihood(const BeamSubset& beams, const BeamModel& model);

/// What the ends of the beams alone tell, as if they had passed nothing.
struct Bound
{
	double log_likelihood;  //!< [nat] that of score() cannot exceed it
	double by_pieces;       //!< [nat] that of log_likelihood_by_pieces(), as if each piece were off by itself
};

/// Returns what the ends of the beams tell of score(). It takes much less time. Thread-safe.
Bound bound_of(
    const BeamTracer& tracer, const DistanceField& field, const BeamSubset& beams, const mrpt::math::TPose2D& sensor,
    const BeamModel& model);
}  // namespace d2s1r
