// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>
#include <mrpt/poses/CPosePDFGaussian.h>

#include <deque>
#include <string>
#include <vector>

#include "frames/window_posterior.h"

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

/// A place where the robot may be now, by the scans of several frames.
struct Track
{
	Hypothesis now;     //!< robot in map; probability is that of all frames together
	Evidence evidence;  //!< by frame, newest last
};

/// Evidence of a frame that does not know a place.
inline constexpr double kNowhere = -50;  //!< [nat]

/// What the places of a frame are compared with.
struct Reference
{
	double log_likelihood = 0;             //!< [nat] of the best pose of the frame
	double temperature = 1;                //!< [-] of its scan
	std::optional<double> by_pieces = {};  //!< [nat] of that pose by the pieces of surface
};

/// Returns the evidence [nat] of its frame for a hypothesis: by the beams or by the pieces of surface, whichever
/// favours it more.
double evidence_of(const Hypothesis& hypothesis, const Reference& reference, const WindowTuning& tuning);

/// Returns whether two hypotheses count as one place.
bool is_one_place(const Hypothesis& a, const Hypothesis& b);

/// Returns the log-likelihood [nat] of a hypothesis; 0 for one that has none, which the default method does not make.
double log_likelihood_of(const Hypothesis& hypothesis);

/// Returns whether a frame with this evidence [nat] speaks against a track, or no wall explains it there.
bool missed(double evidence, const WindowTuning& tuning);

/// Returns what a scan says of the pose at a place, with a larger covariance than the hypothesis has: the map is off by
/// more than the scan's noise, and beams that no wall explains pull the pose.
PoseDensity measurement(const Hypothesis& hypothesis, const WindowTuning& tuning);

/// A predicted pose that a scan has corrected.
struct Correction
{
	PoseDensity pose;                      //!< robot in map, m and rad
	mrpt::math::CMatrixDouble33 measured;  //!< covariance of what the scan alone says of it, see measurement()
	double evidence = 0;                   //!< [nat] see evidence_of()
	double explained = 0;                  //!< [0, 1] see Hypothesis
};

/// Returns the best of the places that the scan may confirm near `predicted`; without one, the pose stays as predicted.
/// Where unknown space explains the scan, it says little about the place and nothing about the pose.
Correction best_correction(
    const PoseDensity& predicted, const std::vector<Hypothesis>& places, const Reference& reference,
    const WindowTuning& tuning);

/// Refines `predicted` and, if the scan does not fit there, searches around it: a refinement finds the place from a few
/// degrees off only where walls are near.
std::optional<Hypothesis> refined_near(
    const Localizer& localizer, const Scan& scan, const PoseDensity& predicted, const WindowTuning& tuning);

/// A pose in one of several maps.
struct PlaceDensity
{
	PoseDensity pose;  //!< robot in map
	std::string map;   //!< its name
};

/// Gives each hypothesis of a scan to that of the predicted poses to which it is nearest: what shows one place confirms
/// no other one.
/// \return by predicted pose
std::vector<std::vector<Hypothesis>> shared_out(
    const std::vector<Hypothesis>& one_shot, const std::vector<PlaceDensity>& predicted, const WindowTuning& tuning);

/// Returns whether one of the hypotheses is the predicted pose itself, as that of a robot that stands still is.
bool is_at_one(const PoseDensity& predicted, const std::vector<Hypothesis>& one_shot, const WindowTuning& tuning);

/// Returns the likeliest place of a frame; null if there is none. Places that unknown space explains count only if
/// there is no other.
const Hypothesis* likeliest(const std::vector<Hypothesis>& places, const WindowTuning& tuning);

/// Returns the log-odds [nat] of "the robot is at none of the places that the scan lists" against the likeliest place
/// of the frame, which may be better than what the scan found alone. A better place counts by what the scan would have
/// said of the presence if it had found this place itself: unknown space may make a place likely where few walls are
/// seen, and such a place says little.
/// \param listed [0, 1] probability that the robot is at one of the places that the scan lists
/// \param fittest the likeliest place; not null if the scan lists a place
double absence(const Localization& one_shot, double listed, const Hypothesis* fittest, const PresenceModel& model);
}  // namespace d2s1r
