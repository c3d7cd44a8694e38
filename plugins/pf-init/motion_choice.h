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
	double odometry_xy_per_m = 0.10;     //!< [m / m] standard deviation of odometry
	double odometry_xy = 0.05;           //!< [m] in addition
	double odometry_phi_per_rad = 0.10;  //!< [rad / rad]
	double odometry_phi_per_m = 0.03;    //!< [rad / m]
	double odometry_phi = 0.02;          //!< [rad] in addition
	double unknown_along = 0.40;         //!< [m] without odometry: change of motion from one scan to the next, ahead
	double unknown_across = 0.20;        //!< [m] sideways
	double unknown_phi = 0.30;           //!< [rad]
	double gate = 3.5;                   //!< [standard deviations] pseudo-odometry beyond is a jump
	double jump_support = 0.05;          //!< [0, 1] weight that a hypothesis is given whatever the filter says
	double pseudo_xy = 0.05;             //!< [m] added to the uncertainty of both ends
	double pseudo_phi = 0.02;            //!< [rad]
};

/// What is known of the motion before looking at localizations: odometry, or that it goes on as before.
mrpt::poses::CPosePDFGaussian predict_motion(
    const std::optional<mrpt::poses::CPose2D>& odometry, const mrpt::poses::CPose2D& previous,
    const MotionParameters& parameters);

/// How much of the filter's weight [0, 1] supports a hypothesis of the previous scan.
using Support = std::function<double(const Hypothesis&)>;

/// The pseudo-odometry between the two hypotheses that probabilities, the filter and the predicted motion make most
/// likely together; none if every pair is a jump.
std::optional<mrpt::poses::CPosePDFGaussian> choose_pseudo_odometry(
    const Localization& previous, const Localization& current, const mrpt::poses::CPosePDFGaussian& predicted,
    const Support& support, const MotionParameters& parameters);

/// Product of two independent estimates of the same increment.
mrpt::poses::CPosePDFGaussian combine(const mrpt::poses::CPosePDFGaussian& a, const mrpt::poses::CPosePDFGaussian& b);
}  // namespace d2s1r::pf
