// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/CMatrixFixed.h>
#include <mrpt/poses/CPosePDFParticles.h>

#include <vector>

namespace d2s1r::pf
{
/// How far from a pose a particle still belongs to its place.
inline constexpr double kPlaceRadius = 1.0;  //!< [m]
inline constexpr double kPlaceAngle = 0.5;   //!< [rad]

/// Whether a robot at `a` is at the place of `b`.
bool are_one_place(const mrpt::math::TPose2D& a, const mrpt::math::TPose2D& b);

/// Weights [0, 1] of the particles, sum 1.
std::vector<double> normalized_weights(const mrpt::poses::CPosePDFParticles& particles);

/// The `count` particles of least weight; equal weights are chosen evenly, not by their order, which is by ancestor.
std::vector<std::size_t> lightest(const mrpt::poses::CPosePDFParticles& particles, std::size_t count);

/// `count` indices of particles in proportion to their weights, in order. \param offset [0, 1) of the first one
std::vector<std::size_t> systematic_draw(const std::vector<double>& weights, std::size_t count, double offset);

/// Where most of the particles' weight is.
struct ParticlePlace
{
	mrpt::math::TPose2D pose;                //!< robot in map, weighted mean of the particles of the place
	mrpt::math::CMatrixDouble33 covariance;  //!< of the particles of the place
	double probability = 0;                  //!< [0, 1] weight of the place
};

/// \param weights of normalized_weights()
ParticlePlace dominant_place(const mrpt::poses::CPosePDFParticles& particles, const std::vector<double>& weights);

/// Weight [0, 1] of the particles within kPlaceRadius and kPlaceAngle of `pose`.
double weight_near(
    const mrpt::poses::CPosePDFParticles& particles, const std::vector<double>& weights,
    const mrpt::math::TPose2D& pose);
}  // namespace d2s1r::pf
