// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/CMatrixFixed.h>
#include <mrpt/math/TPose2D.h>
#include <mrpt/poses/CPose2D.h>
#include <mrpt/poses/CPosePDFSOG.h>

#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace d2s1r
{
enum class Status
{
	kLocalized,  //!< one place explains the scan and stands out
	kAmbiguous,  //!< other places, or "none of them", share the probability; the best one may be wrong
	kRejected,   //!< no place in the map explains the scan
	kInvalid     //!< the observation is not a usable scan
};

const char* to_string(Status status);

/// A place where the robot may be.
struct Hypothesis
{
	mrpt::poses::CPose2D pose;               //!< robot in map, m and rad
	mrpt::math::CMatrixDouble33 covariance;  //!< of pose, (x, y, phi), m^2, m rad, rad^2
	double probability = 0;  //!< [0, 1] that this is the right place; the rest of all hypotheses is "none of them"
	                         //!< and places beyond scoring.hypotheses
	/// [nat] of the scan under the beam model, the best found at this place; higher is better. No value: kPaper, which
	/// has no beam model.
	std::optional<double> log_likelihood;
	/// [0, 1] share of the beams with a return that end at a wall and have passed none. No value: kPaper.
	std::optional<double> explained;
};

/// A hypothesis of the robot, from pose and covariance of its sensor, (x, y, phi), m and rad, in the map frame.
/// Thread-safe.
Hypothesis hypothesis_of_sensor(
    const mrpt::math::TPose2D& sensor, const mrpt::math::CMatrixDouble33& covariance,
    const mrpt::math::TPose2D& sensor_on_robot);

/// Wall-clock time of each stage.
struct StageTimes
{
	double retrieval_ms = 0;     //!< scan -> candidates
	double registration_ms = 0;  //!< candidates -> settled on the walls; kPaper: registered in yaw
	double refinement_ms = 0;    //!< these -> refined, scored hypotheses; kPaper: 0
	double total_ms = 0;
};

/// The answer to "where was this scan taken?".
struct Localization
{
	Status status = Status::kInvalid;
	double confidence = 0;  //!< [0, 1] probability that the robot is at the place of best(): the sum over the
	                        //!< hypotheses within 0.3 m and 10 deg of it
	std::vector<Hypothesis> hypotheses;  //!< by decreasing probability; empty if rejected or invalid
	double relative_entropy =
	    std::numeric_limits<double>::quiet_NaN();  //!< [bit] of the scan and the virtual scan at
	                                               //!< best(), Eq. 1; lower is better; NaN if none
	StageTimes times;
	std::string note;  //!< why, if rejected or invalid; else empty

	/// \throws std::logic_error if there is no hypothesis
	const Hypothesis& best() const;

	/// All hypotheses as a sum of Gaussians; log weights are log probabilities. Empty if there is none.
	mrpt::poses::CPosePDFSOG as_sog() const;
};

/// The answer without a hypothesis: kRejected or kInvalid, and why.
Localization no_place(Status status, const std::string& note);
}  // namespace d2s1r
