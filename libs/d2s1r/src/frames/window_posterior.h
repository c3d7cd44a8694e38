// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <vector>

#include "frames/window_tuning.h"

namespace d2s1r
{
/// What one frame of a window tells, whatever the place.
struct FrameEvidence
{
	/// [0, 1] How much of its scan the frames before it show again, oldest first: see ShownSurface.
	std::vector<double> seen_before;
	/// [nat] Log-odds of "the robot is at none of the places that the scan lists" against the best place of the frame.
	double absence = 0;
	double linked = 1;  //!< [0, 1] probability that the motion since the frame before is right
};

/// [nat] What each frame of a window says about a track, oldest first: log-odds against the best place of the frame, 0
/// at most. Log-likelihoods are divided by the temperature of the scan.
using Evidence = std::deque<double>;

/// The probabilities [0, 1] of tracks, of which one at most is right.
struct WindowPosterior
{
	std::vector<double> tracks;  //!< in the order of the tracks
	double none = 1;             //!< that none of them is right
};

/// Returns the correlation [0, 1] of what two scans say of places, by the share [0, 1] of surfaces that both show.
double correlation(double seen_again, const WindowModel& model);

/// Lets the robot come from one state to another between two frames, whose motion is right with this probability.
/// \param moved [0, 1] how much of the way is new: a robot that stands still does not come into the map by itself
void predict(WindowPosterior& posterior, double linked, double moved, const WindowModel& model);

/// What a frame says of the states, and how much it counts.
struct FrameWeights
{
	double absence = 0;             //!< [nat] see FrameEvidence
	double of_absence = 1;          //!< [-] power of its odds
	std::vector<double> evidence;   //!< [nat] by track, see Evidence
	std::vector<double> of_tracks;  //!< [-] power of the odds, by track
};

/// Multiplies the odds of the states by what a frame says of them. The evidence of tracks is bounded from below.
void weigh(WindowPosterior& posterior, const FrameWeights& frame, const WindowModel& model);

/// Lowers the probability of "none of them" to what the newest scan alone gives it: whatever the frames before say, the
/// robot may have come into the map since, and this scan shows it.
/// \param evidence [nat] of the newest frame, by track
void admit_presence(WindowPosterior& posterior, double absence, const std::vector<double>& evidence);

/// Returns for how many independent scans [0, 1] each frame counts: one divided by the number of those that say the
/// same again.
std::vector<double> independence(const std::vector<FrameEvidence>& frames, const WindowModel& model);

/// Returns what the frames tell together: the forward pass of a hidden Markov model, whose states are the tracks and
/// "none of them".
///
/// From one frame to the next the robot stays on its track but for small probabilities: that it was carried away, that
/// it left or entered what the map shows, that its motion is not known. Each frame then multiplies the odds by its
/// evidence, to a power. The newest frame counts as much as it does alone. Those before it count by what is new in
/// them: where the map is wrong or a thing has been moved, all frames that show it err together, so that five scans of
/// one bay say what one scan says. So the answer of a robot that stands still or turns on the spot is that of its
/// newest scan. The constants are learned by learn_windows.py.
/// \param frames of the window, oldest first, at least one
/// \param tracks the evidence of each track, by frame
WindowPosterior posterior(
    const std::vector<FrameEvidence>& frames, const std::vector<const Evidence*>& tracks, const WindowModel& model);

/// Returns whether one track is more probable than another, as far as a float tells. Tracks that no frame supports
/// differ by rounding errors of exp() and log() alone, which are others on each kind of processor; these must not order
/// them.
bool is_more_probable(double one, double other);
}  // namespace d2s1r
