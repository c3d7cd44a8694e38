// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/atlas.h>

#include <functional>
#include <memory>
#include <optional>

namespace d2s1r
{
class WindowTracker;

/// Localizes by the scans of the last frames together. Places that look alike in one scan, such as the arms of a
/// symmetric building or the places along a corridor, seldom look alike in ten.
///
/// Many hypotheses of every frame are followed along the robot's motion, forwards into later frames and backwards into
/// earlier ones; each is a Gaussian that the motion widens and every scan corrects (Jensfelt and Kristensen,
/// "Active Global Localization for a Mobile Robot Using Multiple Hypothesis Tracking", 2001). A hidden Markov model,
/// whose states are these tracks and "none of them", tells how probable each is. The evidence of a frame is bounded, so
/// that no scan is trusted blindly: after a kidnapping the new place wins within a few frames. More scans of one
/// place add no evidence: a robot that stands still gets the answer of its scan.
///
/// Use one object per robot, and call it once per frame, in order. It is not thread-safe; the same calls always give
/// the same answers.
class WindowLocalizer
{
   public:
	/// Keeps a reference to `localizer`.
	/// \param frames [-] that are judged together, at least 1
	/// \param prior of the robot at every frame: tracks that leave it are dropped
	/// \throws std::invalid_argument if `frames` is below 1 or the localizer's method is kPaper
	WindowLocalizer(const Localizer& localizer, int frames, const Prior& prior = {});

	/// The same in an atlas, to which it keeps a reference: tracks in all maps are compared with each other. A robot
	/// that leaves one map for another, as by an elevator, is found there within a few frames, as after a kidnapping.
	/// The region of each map is the prior there.
	/// \throws std::invalid_argument if `frames` is below 1
	WindowLocalizer(const Atlas& atlas, int frames);

	~WindowLocalizer();
	/// Leaves the other one empty: it can only be destroyed or assigned to.
	WindowLocalizer(WindowLocalizer&&) noexcept;
	/// Also leaves the other one empty.
	WindowLocalizer& operator=(WindowLocalizer&&) noexcept;

	/// Answers where the robot was when `scan` was taken.
	/// \param one_shot what localizer.localize(scan), or that of the atlas, answered
	/// \param motion of the robot since the last call, in its frame then. Without a value, or with one that
	///        OdometryCheck does not rely on, it is estimated from the hypotheses of both frames (the paper's
	///        pseudo-odometry); if these do not agree, the answer is `one_shot`, and a new window starts. Frames
	///        without a valid scan, with one of a covered sensor, or with neither motion nor hypothesis: pass the
	///        motion of each; if nobody knows one, up to two such frames are bridged by the frame after them. Otherwise
	///        a new window starts.
	/// \throws std::invalid_argument if a hypothesis of `one_shot` is in a map that the window was not given, or it holds
	///         numbers that are not finite or not in their ranges
	/// \return as Localizer::localize(), with the evidence of all frames of the window: log-likelihoods are sums over
	///         them (see Hypothesis); covariances include the motion, and the time of
	///         refinement includes the following of hypotheses
	Localization add(
	    const Scan& scan, const Localization& one_shot, const std::optional<mrpt::poses::CPose2D>& motion = {});

	/// Localizes an observation on its own, then answers where the robot was when it was taken.
	/// \param sweep when each beam was taken; pose and `motion` are about its time 0
	Localization add(
	    const RangeScan& observation, const std::optional<mrpt::poses::CPose2D>& motion = {}, const Sweep& sweep = {});

   private:
	std::unique_ptr<WindowTracker> tracker_;
	std::function<Localization(const Scan&)> localize_;  //!< what the scan says alone
};
}  // namespace d2s1r
