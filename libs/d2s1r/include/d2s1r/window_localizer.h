// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>

#include <deque>
#include <optional>

namespace d2s1r
{
/// What one frame says about a track.
struct Evidence
{
	double log_likelihood = 0;  //!< [nat] against the best pose of the frame, bounded below
	double explained = 0;       //!< see Hypothesis
	double alone = 0;           //!< [0, 1] probability of the place by this frame alone
};

/// Where the robot may be now, by the scans of several frames.
struct Track
{
	Hypothesis now;                 //!< robot in map; probability and log_likelihood are those of all frames together
	std::deque<Evidence> evidence;  //!< by frame, newest last
};

/// Localizes by the scans of the last frames together: what looks alike in one scan, such as the arms of a symmetric
/// building or the places along a corridor, seldom does in ten.
///
/// Many hypotheses of every frame are followed along the robot's motion, forwards into the frames to come and backwards
/// into those that were; each is a Gaussian that the motion widens and every scan corrects (Jensfelt and Kristensen,
/// "Active Global Localization for a Mobile Robot Using Multiple Hypothesis Tracking", 2001). The evidence of a frame
/// is bounded, so that no scan is trusted blindly: after a kidnapping the new place wins within a few frames. Tracks
/// are only compared with each other, and on a wrong map one of them is the best, too: a track is localized only if
/// walls explain its scans and some of them found its place on their own.
///
/// One object a robot, one call a frame, in order. Not thread-safe; the same calls always give the same answers.
class WindowLocalizer
{
   public:
	static constexpr int kHypotheses = 50;  //!< [-] a frame that are worth following: for ScoringParameters::hypotheses

	/// Keeps a reference to `localizer`.
	/// \param frames [-] that are judged together, at least 1
	/// \param prior of the robot at every frame: tracks that leave it are dropped
	/// \throws std::invalid_argument if `frames` is below 1 or the localizer's method is kPaper
	WindowLocalizer(const Localizer& localizer, int frames, const Prior& prior = {});

	/// Where is the robot, now that `scan` was taken?
	/// \param one_shot localizer.localize(scan)
	/// \param motion of the robot since the last call, in its frame then; no value: estimated from the hypotheses of
	///        both frames (the paper's pseudo-odometry)
	/// \return as Localizer::localize(), with the evidence of all frames of the window; covariances include the motion,
	///         and the time of refinement includes the following of hypotheses
	Localization add(
	    const Scan& scan, const Localization& one_shot, const std::optional<mrpt::poses::CPose2D>& motion = {});

   private:
	struct Frame
	{
		Scan scan;
		std::vector<Hypothesis> one_shot;
		double reference = 0;         //!< [nat] log-likelihood of the best pose
		mrpt::poses::CPose2D motion;  //!< since the frame before, in the robot frame then
		mrpt::math::CMatrixDouble33 motion_covariance;
	};

	void set_motion(
	    Frame& frame, const Localization& one_shot, const std::optional<mrpt::poses::CPose2D>& motion) const;
	void follow(const Localization& one_shot);
	void start_tracks(const Localization& one_shot);
	bool trace_back(Track& track) const;
	bool lost(const Localization& one_shot) const;
	void forget();
	void prune();
	Localization conclude(const Localization& one_shot) const;

	const Localizer* localizer_;
	std::size_t most_frames_;
	Prior prior_;
	std::optional<mrpt::poses::CPose2D> skipped_;  //!< motion over frames without a usable scan
	std::deque<Frame> frames_;                     //!< newest last
	std::vector<Track> tracks_;                    //!< best first
};
}  // namespace d2s1r
