// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>
#include <mrpt/poses/CPosePDFGaussian.h>

#include <deque>
#include <vector>

#include "frames/window_tuning.h"

namespace d2s1r
{
/// A Gaussian of a pose or of a motion.
using PoseDensity = mrpt::poses::CPosePDFGaussian;

/// A motion that nobody measured.
struct GuessedMotion
{
	PoseDensity motion;      //!< robot frame at its start
	double probability = 0;  //!< [0, 1] that the robot made it
};

/// Returns the motion that takes most of the hypotheses of one frame, by probability, to hypotheses of the next. If
/// there is none, its probability is 0. A motion is the more probable the more of the pairs of hypotheses share it;
/// other pairs count as jumps, and so does that the robot is at none of them.
GuessedMotion common_motion(
    const std::vector<Hypothesis>& from, const std::vector<Hypothesis>& to, const WindowTuning& tuning);

/// Returns the motion from the end back to the start, in the robot frame at the end.
PoseDensity reversed(const PoseDensity& motion);

/// Returns where a robot at `pose` is after `motion`, which is in its frame.
PoseDensity moved(const PoseDensity& pose, const PoseDensity& motion);

/// What one frame says about a track.
struct Evidence
{
	double log_likelihood = 0;        //!< [nat] against the best pose of the frame, from least_evidence to about 0
	double explained = 0;             //!< [0, 1] see Hypothesis
	double one_shot_probability = 0;  //!< [0, 1] that this frame alone gives to the place
};

/// A place where the robot may be now, by the scans of several frames.
struct Track
{
	Hypothesis now;                 //!< robot in map; probability and log_likelihood are those of all frames together
	std::deque<Evidence> evidence;  //!< by frame, newest last
};

/// Returns the evidence for a hypothesis whose log-likelihood is `relative` [nat] to the best one of its frame.
Evidence evidence_of(const Hypothesis& hypothesis, double relative, const WindowTuning& tuning);

/// Returns the log-likelihood [nat] of a hypothesis; 0 for one that has none, which the default method does not make.
double log_likelihood_of(const Hypothesis& hypothesis);

/// Returns whether a frame speaks against a track: its evidence is nearer to the least than to none.
bool missed(const Evidence& evidence, const WindowTuning& tuning);

/// Returns what a scan says of the pose at a place, with a larger covariance than the hypothesis has: the map is off by
/// more than the scan's noise, and beams that no wall explains pull the pose.
PoseDensity measurement(const Hypothesis& hypothesis, const WindowTuning& tuning);

/// A predicted pose that a scan has corrected.
struct Correction
{
	PoseDensity pose;  //!< robot in map, m and rad
	Evidence evidence;
};

/// Returns the best of the places near `predicted` that the scan may confirm; without one, the pose stays as predicted.
/// Where unknown space explains the scan, it says little about the place and nothing about the pose.
/// \param reference [nat] log-likelihood of the best pose of the frame
Correction best_correction(
    const PoseDensity& predicted, const std::optional<Hypothesis>& refined, const std::vector<Hypothesis>& one_shot,
    double reference, const WindowTuning& tuning);

/// Refines `predicted` and, if the scan does not fit there, searches around it: a refinement finds the place from a few
/// degrees off only where walls are near.
std::optional<Hypothesis> refined_near(
    const Localizer& localizer, const Scan& scan, const PoseDensity& predicted, const WindowTuning& tuning);

/// Returns the log-likelihood [nat] of the likeliest place of a frame. Places that unknown space explains count only if
/// there is no other.
double greatest_likelihood(
    const std::vector<std::optional<Hypothesis>>& refined, const std::vector<Hypothesis>& one_shot,
    const WindowTuning& tuning);

/// Returns the sum of the evidence [nat] of the last `frames` frames of a track.
double sum_of(const std::deque<Evidence>& evidence, std::size_t frames);

/// Returns the sum of the evidence [nat] of all frames of a track.
double sum_of(const Track& track);

/// Returns the mean share [0, 1] of explained beams in the last frames of a track.
double explained_by(const Track& track);

/// Returns the probability [0, 1] that one scan alone gives to the place of a track, in the mean of its frames.
double one_shot_probability(const Track& track);
}  // namespace d2s1r
