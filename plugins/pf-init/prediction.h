// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <d2s1r/parameters.h>
#include <mrpt/bayes/CParticleFilter.h>
#include <mrpt/poses/CPosePDFGaussian.h>
#include <mrpt/slam/CMonteCarloLocalization2D.h>

#include <functional>
#include <optional>
#include <vector>

#include "tuning.h"

namespace d2s1r::pf
{
/// Returns that the robot goes on as before, which is what is known of the motion without odometry before anyone looks
/// at the localizations.
mrpt::poses::CPosePDFGaussian predict_motion(const mrpt::poses::CPose2D& previous, const FilterParameters& parameters);

/// Returns how much of the filter's weight [0, 1] is near a hypothesis of the previous scan.
using Support = std::function<double(const Hypothesis&)>;

/// Two successive localizations and what the motion between them should be.
struct MotionEvidence
{
	const Localization& previous;
	const Localization& current;
	mrpt::poses::CPosePDFGaussian predicted;
};

/// Returns the motion between the two hypotheses that are most likely together, by their probabilities, the support of
/// the filter and the predicted motion. It is combined with the predicted motion, unless it contradicts that: then the
/// product of both probabilities and of the support, to which `unlisted` is added, has to be above kProbable, and the
/// motion no jump. There is no such motion if that leaves no pair.
std::optional<mrpt::poses::CPosePDFGaussian> choose_motion(
    const MotionEvidence& evidence, const Support& support, const Tuning& tuning);

/// Draws `count` of the particles in proportion to their weights.
/// \param offset [0, 1) of the first draw
/// \return their indices, in ascending order
std::vector<std::size_t> systematic_draw(const std::vector<double>& weights, std::size_t count, double offset);

/// Draws `count` of the particles, each as often as its weight asks for; all weigh the same then. MRPT's
/// computeResampling() never returns if it is to draw more than there are.
/// \param offset as in systematic_draw()
void resize(mrpt::poses::CPosePDFParticles& particles, std::size_t count, double offset);

/// Returns MRPT's particle filter, set to keep the number of particles: KLD would grow a seed of several places to tens
/// of thousands.
mrpt::bayes::CParticleFilter filter_of_fixed_size();

/// Moves each particle by a motion that is drawn from `motion` with MRPT's random generator of this thread.
void move_particles(mrpt::slam::CMonteCarloLocalization2D& particles, const mrpt::poses::CPosePDFGaussian& motion);
}  // namespace d2s1r::pf
