// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/CFusionBackend.h>
#include <mrpt/poses/CPosePDFGaussian.h>

#include <functional>

namespace d2s1r::pf
{
/// Noise of the motion models; increments in the previous robot frame.
struct MotionParameters
{
	double unknown_along = 0.80;     //!< [m] without odometry: change of motion from one scan to the next, ahead
	double unknown_across = 0.30;    //!< [m] sideways
	double unknown_phi = 0.60;       //!< [rad]
	double gate = 3.5;               //!< [standard deviations] of the predicted motion: beyond is a surprise
	double surprise = 3.0;           //!< [nat] what a pair must outweigh to be believed beyond the gate
	double odometry_surprise = 7.0;  //!< [nat] the same if the predicted motion is odometry
	double farthest = 2.0;           //!< [m] between two scans without odometry: beyond is a jump
	double widest_turn = 1.7;        //!< [rad] the same
	double least_score = -7.5;       //!< [nat] of a pair that is believed
	double least_support = 0.05;     //!< [0, 1] that a hypothesis is given whatever the filter says
	double pseudo_xy = 0.05;         //!< [m] added to the uncertainty of both ends
	double pseudo_phi = 0.02;        //!< [rad]
};

/// What is known of the motion before looking at localizations: odometry, or that it goes on as before.
mrpt::poses::CPosePDFGaussian predict_motion(
    const std::optional<mrpt::poses::CPose2D>& odometry, const mrpt::poses::CPose2D& previous,
    const MotionParameters& parameters);

/// How much of the filter's weight [0, 1] supports a hypothesis of the previous scan.
using Support = std::function<double(const Hypothesis&)>;

/// Two successive localizations and what to make of them.
struct MotionEvidence
{
	const Localization& previous;
	const Localization& current;
	mrpt::poses::CPosePDFGaussian predicted;
	bool is_measured = false;  //!< predicted is odometry: only confident localizations overrule it
};

/// The motion by the pseudo-odometry between the two hypotheses that their probabilities, the filter and the predicted
/// motion make most likely together, combined with the predicted motion unless that is overruled; none if every pair is
/// a jump.
std::optional<mrpt::poses::CPosePDFGaussian> choose_motion(
    const MotionEvidence& evidence, const Support& support, const MotionParameters& parameters);
}  // namespace d2s1r::pf
