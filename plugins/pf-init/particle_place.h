// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <mrpt/math/CMatrixFixed.h>
#include <mrpt/poses/CPosePDFParticles.h>

#include <vector>

namespace d2s1r::pf
{
/// A particle belongs to the place of a pose if it is no farther away than this: twice what makes two poses one place,
/// as two particles are that lie on both sides of it.
inline constexpr double kPlaceRadius = 2 * kPlaceDistance;  //!< [m]
inline constexpr double kPlaceAngle = 2 * kPlaceYaw;        //!< [rad]

/// A hypothesis supports particles with these standard deviations: twice of them is what makes two poses one place.
inline constexpr double kSupportedDistance = kPlaceDistance / 2;  //!< [m]
inline constexpr double kSupportedYaw = kPlaceYaw / 2;            //!< [rad]

/// Returns whether a robot at `a` is within `radius` [m] and `angle` [rad] of `b`: at the place of `b`.
bool are_one_place(
    const mrpt::math::TPose2D& a, const mrpt::math::TPose2D& b, double radius = kPlaceRadius,
    double angle = kPlaceAngle);

/// Returns the weights [0, 1] of the particles; their sum is 1.
std::vector<double> normalized_weights(const mrpt::poses::CPosePDFParticles& particles);

/// The place that holds most of the particles' weight.
struct ParticlePlace
{
	mrpt::math::TPose2D pose;                //!< robot in map, weighted mean of the particles of the place
	mrpt::math::CMatrixDouble33 covariance;  //!< of the particles of the place
	double probability = 0;                  //!< [0, 1] weight of the place
};

/// Returns the place that holds most of the weight.
/// \param weights as normalized_weights() returns them
ParticlePlace dominant_place(const mrpt::poses::CPosePDFParticles& particles, const std::vector<double>& weights);

/// Returns the weight [0, 1] of the particles within `radius` [m] and `angle` [rad] of `pose`.
double weight_near(
    const mrpt::poses::CPosePDFParticles& particles, const std::vector<double>& weights,
    const mrpt::math::TPose2D& pose, double radius = kPlaceRadius, double angle = kPlaceAngle);
}  // namespace d2s1r::pf
