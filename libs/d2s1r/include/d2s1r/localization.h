// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/core/bits_math.h>
#include <mrpt/math/CMatrixFixed.h>
#include <mrpt/math/TPose2D.h>
#include <mrpt/poses/CPose2D.h>
#include <mrpt/poses/CPosePDFSOG.h>

#include <optional>
#include <string>
#include <vector>

namespace d2s1r
{
/// Says what a scan tells about the place of the robot.
enum class Status
{
	kLocalized,  //!< one place explains the scan and stands out
	kAmbiguous,  //!< other places, or "none of them", share the probability; the best one may be wrong
	kRejected,   //!< no place in the map explains the scan
	kInvalid     //!< the observation is not a usable scan
};

/// Returns `localized`, `ambiguous`, `rejected` or `invalid`.
const char* to_string(Status status);

/// Poses nearer to each other than both of these are one place.
inline constexpr double kPlaceDistance = 0.5;             //!< [m]
inline constexpr double kPlaceYaw = mrpt::DEG2RAD(10.0);  //!< [rad]

/// Describes a place where the robot may be.
struct Hypothesis
{
	mrpt::poses::CPose2D pose;               //!< robot in map, m and rad
	mrpt::math::CMatrixDouble33 covariance;  //!< of pose, (x, y, phi), m^2, m rad, rad^2
	/// [0, 1] Probability that this is the right place. The probabilities of a result may sum to less than 1; the rest
	/// is the probability of "none of them" and of places beyond scoring.hypotheses.
	double probability = 0;
	/// [nat] Log-likelihood of the scan under the beam model, the best that was found at this place; higher is better.
	/// After WindowLocalizer::add() it is the sum over the frames of their evidence: the log-likelihood against the
	/// best pose of the frame, divided by the temperature of its scan. It has no value with kPaper, which has no beam
	/// model.
	std::optional<double> log_likelihood;
	/// [nat] The same by the pieces of surface that the scan shows, each of which the map may have some centimetres
	/// off; 0 at most. It has no value with kPaper and after WindowLocalizer::add().
	std::optional<double> by_pieces;
	/// [0, 1] Share of the returns that are explained: they end at a wall and passed none. It has no value with kPaper.
	std::optional<double> explained;
	/// [nat] Log-odds that the scan was taken in this map, by how it fits at this place and without what other places
	/// say (PresenceModel but for its lead). It has no value with kPaper.
	std::optional<double> log_odds;
	std::string map = {};  //!< name of the map that `pose` is in, from an Atlas; empty from a Localizer
};

/// Checks a hypothesis that a caller passes to the library. Thread-safe.
/// \throws std::invalid_argument if its pose, covariance or another number is not finite, a variance is negative, or its
///         probability is not in [0, 1]
void check(const Hypothesis& hypothesis);

/// Returns the hypothesis of a robot whose sensor has this pose and covariance, (x, y, phi), m and rad, in the map
/// frame. Thread-safe.
Hypothesis hypothesis_of_sensor(
    const mrpt::math::TPose2D& sensor, const mrpt::math::CMatrixDouble33& covariance,
    const mrpt::math::TPose2D& sensor_on_robot);

/// Holds the wall-clock time of each stage.
struct StageTimes
{
	double retrieval_ms = 0;     //!< [ms] from the scan to candidates
	double registration_ms = 0;  //!< [ms] from candidates to settled poses; kPaper: to their yaws
	double refinement_ms = 0;    //!< [ms] from these to scored hypotheses; kPaper: 0
	double total_ms = 0;         //!< [ms] of all stages
};

/// Answers "where was this scan taken?".
struct Localization
{
	Status status = Status::kInvalid;  //!< what the scan tells
	/// [0, 1] Probability that the robot is at the place of best(). With kDefault it is the probability of best(),
	/// because a place includes all poses near it; with kPaper it is the sum over the hypotheses at that place.
	double confidence = 0;
	/// [0, 1] Probability that the robot is at one of the places of the map that explain the scan, listed or not; the
	/// rest is the probability that none of them is right. It is 0 for invalid scans and with kPaper, which has no
	/// model of it.
	double presence = 0;
	/// [-] Number that divides differences of log-likelihoods of this scan to give log-odds. It grows with the beams
	/// that contradict the map, because more of a difference is chance then.
	double temperature = 1;
	std::vector<Hypothesis> hypotheses;  //!< by decreasing probability; empty if rejected or invalid
	/// [bit] Relative entropy between the scan and the virtual scan at best(), Eq. 1; lower is better. It has no value
	/// without a hypothesis.
	std::optional<double> relative_entropy;
	StageTimes times;  //!< how long the answer took
	std::string note;  //!< says why a scan was rejected or is invalid; else empty

	/// Returns the most probable hypothesis.
	/// \throws std::logic_error if there is none
	const Hypothesis& best() const;

	/// Returns all hypotheses as a sum of Gaussians, whose log weights are log probabilities; empty if there is none.
	mrpt::poses::CPosePDFSOG as_sog() const;
};

/// Returns an answer without a hypothesis, which is kRejected or kInvalid, and says why.
Localization no_place(Status status, const std::string& note);
}  // namespace d2s1r
