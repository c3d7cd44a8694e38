// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/atlas.h>
#include <d2s1r/motion.h>
#include <mrpt/poses/CPosePDFGaussian.h>

#include <memory>
#include <optional>
#include <string>

namespace d2s1r
{
/// Says what became of a pose that somebody suggested to a Tracker.
enum class Suggestion
{
	kNone,    //!< nobody suggested any, or what became of the last one is no news any more
	kOpen,    //!< no scan has told yet
	kTaken,   //!< the robot is there
	kRefused  //!< the robot is elsewhere: the scans do not allow it
};

/// Follows a robot without an end: it finds the robot, keeps its pose from scan to scan, and notices by itself when the
/// robot is elsewhere. No other tracker is needed.
///
/// It carries the hidden Markov model of WindowLocalizer on from scan to scan. Its states are the places where the
/// robot may be, each a Gaussian, and "none of them". Each scan is first explained near the places that are followed,
/// which takes a small part of the time of a search. The whole map is searched if no place is known yet, if the scan is
/// explained less well than the scans before promise, and once a second besides. So a robot that was
/// carried away, or was followed in a wrong place, is found within about a second. Between scans, and while scans
/// cannot tell, the poses move by the odometry, and their covariances grow (Fox, Burgard and Thrun, "Markov
/// Localization for Mobile Robots in Dynamic Environments", 1999; Jensfelt and Kristensen, "Active Global Localization
/// for a Mobile Robot Using Multiple Hypothesis Tracking", 2001).
///
/// Use one object per robot. It is not thread-safe; it reads no clock, and the same calls always give the same answers.
class Tracker
{
   public:
	/// Keeps a reference to `localizer`.
	/// \param prior where the robot is at all times
	/// \throws std::invalid_argument if the localizer's method is kPaper
	explicit Tracker(const Localizer& localizer, const Prior& prior = {});

	/// The same in an atlas, to which it keeps a reference; the region of each map is the prior there.
	explicit Tracker(const Atlas& atlas);

	~Tracker();
	/// Leaves the other one empty: it can only be destroyed or assigned to.
	Tracker(Tracker&&) noexcept;
	/// Also leaves the other one empty.
	Tracker& operator=(Tracker&&) noexcept;

	/// Takes in the next scan.
	/// \param time [s] of the scan, by any clock; one that is not after the last one counts as a second later
	/// \param scan also one that is not valid: it moves the robot
	/// \param motion of the robot since the last call, in its frame then. Without a value, or with one that
	///        OdometryCheck does not rely on, the robot may have gone and turned at the usual speeds of Sweep.
	/// \return where the robot was when the scan was taken. It is localized if one place has a probability above
	///         scoring.localized_above, and above 0.8 by the scans before and the last ones on average, and its pose
	///         is known to kPlaceDistance and kPlaceYaw but for errors that scans share; rejected if no place is known,
	///         and otherwise ambiguous. Hypothesis::probability is by all scans; log_likelihood, explained and log_odds
	///         are by the last scan that confirmed the place. `note` says why a pose is held. There is no relative
	///         entropy; the times are those of this call.
	Localization add(double time, const Scan& scan, const std::optional<mrpt::poses::CPose2D>& motion = {});

	/// Returns where the robot is after a motion since the last call of add(), in its frame then: the most probable
	/// hypothesis, with a covariance that includes the motion; no value if no place is known.
	/// \param seconds [s] since that call; it matters only without a motion, or with one that is not relied on
	std::optional<Hypothesis> after(const std::optional<mrpt::poses::CPose2D>& motion, double seconds = 0) const;

	/// Takes in where a person believes the robot to be at the next scan: a prior, which the scans may refuse.
	/// \param robot in map, (x, y, phi), m and rad
	/// \param map its name in the atlas; empty with a Localizer
	/// \throws std::invalid_argument if the density is not finite or the map is unknown
	void suggest(const mrpt::poses::CPosePDFGaussian& robot, const std::string& map = {});

	/// Returns what became of the last suggestion; kTaken and kRefused until the next call of add() after that.
	Suggestion suggestion() const;

	/// Returns what localized scans told of the odometry.
	const OdometryEstimate& odometry() const;

   private:
	struct State;
	std::unique_ptr<State> state_;
};
}  // namespace d2s1r
