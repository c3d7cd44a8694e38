// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>
#include <mrpt/poses/CPose3DPDFParticles.h>
#include <mrpt/poses/CPosePDFParticles.h>

namespace d2s1r
{
/// Says how hypotheses become particles.
struct SeedingParameters
{
	int particles = 1000;            //!< [-] in total
	double free_space_share = 0.05;  //!< [0, 1] share of the particles that lie anywhere in free space
	double min_std_xy = 0.05;        //!< [m] least standard deviation of a hypothesis, along x and along y
	double min_std_phi = 0.02;       //!< [rad] least standard deviation of a hypothesis
	double std_z = 0;                //!< [m] standard deviation of 3D particles
	double std_pitch_roll = 0;       //!< [rad] standard deviation of 3D particles
	std::uint32_t seed = 1;          //!< [-] the same seed gives the same particles
};

/// Holds a pose of the robot and its weight.
struct SeededParticle
{
	mrpt::math::TPose2D pose;  //!< robot in map, m and rad
	double log_weight = 0;     //!< [nat] the weights of all particles sum to 1
};

/// Draws particles for every hypothesis of `localization` in proportion to its probability, at least one each if there
/// are enough, and for free space. The draw is stratified, so that the weights of the particles of a
/// hypothesis sum to its probability. The rest of the probability is spread over the free cells of the map that `prior`
/// allows; if there are none, all particles go to hypotheses. Thread-safe.
/// \param localizer whose map the robot is in
/// \param localization an answer of `localizer`
/// \param prior says where particles in free space may lie
/// \throws std::invalid_argument if there is neither a hypothesis nor a free cell, a hypothesis is not finite or its
///         probability not in [0, 1], or a parameter is out of range
std::vector<SeededParticle> seed_particles(
    const Localizer& localizer, const Localization& localization, const SeedingParameters& parameters = {},
    const Prior& prior = {});

/// Replaces the particles of `pdf`, which is a CPosePDFParticles or a CMonteCarloLocalization2D.
void assign_particles(mrpt::poses::CPosePDFParticles& pdf, const std::vector<SeededParticle>& particles);

/// Replaces the particles of `pdf`, which is a CPose3DPDFParticles or a CMonteCarloLocalization3D. z, pitch and roll
/// are drawn about zero.
/// \throws std::invalid_argument if a parameter is out of range
void assign_particles(
    mrpt::poses::CPose3DPDFParticles& pdf, const std::vector<SeededParticle>& particles,
    const SeedingParameters& parameters);
}  // namespace d2s1r
