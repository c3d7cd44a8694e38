// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>

#include <deque>

#include "frames/track_motion.h"

namespace d2s1r
{
/// What one frame says about a track.
struct Evidence
{
	double log_likelihood = 0;        //!< [nat] against the best pose of the frame, from kLeastEvidence to about 0
	double explained = 0;             //!< see Hypothesis
	double one_shot_probability = 0;  //!< [0, 1] of the place by this frame alone
};

/// Where the robot may be now, by the scans of several frames.
struct Track
{
	Hypothesis now;                 //!< robot in map; probability and log_likelihood are those of all frames together
	std::deque<Evidence> evidence;  //!< by frame, newest last
};

/// Least of a frame: scans may show what is not in the map.
inline constexpr double kLeastEvidence = -8;  //!< [nat]

/// Of a hypothesis whose log-likelihood is `relative` [nat] to the best one of its frame.
Evidence evidence_of(const Hypothesis& hypothesis, double relative);

/// [nat] 0 for a hypothesis that has none, which the default method does not make.
double log_likelihood_of(const Hypothesis& hypothesis);

bool missed(const Evidence& evidence);

/// What a scan says at a place, less sure of itself: the map is off by more than the scan's noise, and beams that no
/// wall explains pull the pose.
PoseDensity measurement(const Hypothesis& hypothesis);

struct Correction
{
	PoseDensity pose;  //!< corrected by the scan
	Evidence evidence{kLeastEvidence, 0, 0};
};

/// The best of the places near `predicted` that the scan may confirm; no place: as predicted. Where unknown space
/// explains the scan, it says little about the place and nothing about the pose.
/// \param reference [nat] log-likelihood of the best pose of the frame
Correction best_correction(
    const PoseDensity& predicted, const std::optional<Hypothesis>& refined, const std::vector<Hypothesis>& one_shot,
    double reference);

/// Refined from `predicted` and, if the scan does not fit there, searched for around it: a refinement finds the place
/// from a few degrees off only where walls are near.
std::optional<Hypothesis> refined_near(const Localizer& localizer, const Scan& scan, const PoseDensity& predicted);

/// [nat] of the likeliest place of a frame; places that unknown space explains count only if there is no other.
double greatest_likelihood(
    const std::vector<std::optional<Hypothesis>>& refined, const std::vector<Hypothesis>& one_shot);

/// [nat] of the last `frames` frames of a track.
double sum_of(const std::deque<Evidence>& evidence, std::size_t frames);
double sum_of(const Track& track);

/// [-] mean share of explained beams.
double explained_by(const Track& track);

/// [0, 1] in the mean, that one scan alone gives to the place.
double one_shot_probability(const Track& track);
}  // namespace d2s1r
