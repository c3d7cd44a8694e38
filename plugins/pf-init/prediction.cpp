// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "prediction.h"

#include <d2s1r/motion.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/obs/CActionCollection.h>

#include <algorithm>
#include <cmath>

#include "particle_place.h"
#include "weighing.h"

namespace d2s1r::pf
{
namespace
{
using mrpt::poses::CPosePDFGaussian;

/// Returns the motion between two hypotheses, which is known no better than odometry knows the shortest one.
CPosePDFGaussian pseudo_motion(const Hypothesis& from, const Hypothesis& to, const OdometryTuning& tuning)
{
	CPosePDFGaussian motion = increment_between(from, to);
	const auto added = odometry_motion({}, tuning).cov;
	for (int i = 0; i < 3; i++) motion.cov(i, i) += added(i, i);
	return motion;
}

/// Returns whether no robot moves so from one scan to the next.
bool is_jump(const mrpt::poses::CPose2D& increment, const Tuning& tuning)
{
	return increment.norm() > tuning.farthest || std::abs(increment.phi()) > mrpt::DEG2RAD(tuning.odometry.widest_turn);
}
}  // namespace

CPosePDFGaussian predict_motion(const mrpt::poses::CPose2D& previous, const FilterParameters& parameters)
{
	return {previous, covariance_of(parameters.motion_along, parameters.motion_across, parameters.motion_turn)};
}

std::optional<CPosePDFGaussian> choose_motion(
    const MotionEvidence& evidence, const Support& support, const Tuning& tuning)
{
	const CPosePDFGaussian& predicted = evidence.predicted;
	std::optional<CPosePDFGaussian> best;
	double most = 0;  // [-] higher is better
	for (const Hypothesis& from : evidence.previous.hypotheses)
	{
		const double of_start = from.probability * (tuning.unlisted + support(from));
		for (const Hypothesis& to : evidence.current.hypotheses)
		{
			const CPosePDFGaussian increment = pseudo_motion(from, to, tuning.odometry);
			const double off = mrpt::square(mahalanobis_distance(predicted, increment));
			const double of_both = of_start * to.probability;
			const bool is_surprise = off > kMostOff;
			if (is_surprise && (of_both < kProbable || is_jump(increment.mean, tuning))) continue;
			const double likelihood = of_both * std::exp(-0.5 * std::min(off, kMostOff));
			if (likelihood <= most) continue;
			most = likelihood;
			best = is_surprise ? increment : combine(predicted, increment);
		}
	}
	return best;
}

std::vector<std::size_t> systematic_draw(const std::vector<double>& weights, std::size_t count, double offset)
{
	std::vector<std::size_t> drawn;
	std::size_t i = 0;
	double sum = weights.at(0);
	for (std::size_t k = 0; k < count; k++)
	{
		const double mark = (static_cast<double>(k) + offset) / static_cast<double>(count);
		while (sum < mark && i + 1 < weights.size()) sum += weights[++i];
		drawn.push_back(i);
	}
	return drawn;
}

void resize(mrpt::poses::CPosePDFParticles& particles, std::size_t count, double offset)
{
	particles.performSubstitution(systematic_draw(normalized_weights(particles), count, offset));
	for (auto& particle : particles.m_particles) particle.log_w = 0;
}

mrpt::bayes::CParticleFilter filter_of_fixed_size()
{
	mrpt::bayes::CParticleFilter filter;
	filter.m_options.adaptiveSampleSize = false;
	filter.m_options.resamplingMethod = mrpt::bayes::CParticleFilter::prSystematic;
	return filter;
}

void move_particles(mrpt::slam::CMonteCarloLocalization2D& particles, const CPosePDFGaussian& motion)
{
	mrpt::obs::CActionRobotMovement2D action;
	action.estimationMethod = mrpt::obs::CActionRobotMovement2D::emScan2DMatching;
	action.rawOdometryIncrementReading = motion.mean;
	action.poseChange = CPosePDFGaussian::Create(motion);
	mrpt::obs::CActionCollection actions;
	actions.insert(action);
	filter_of_fixed_size().executeOn(particles, &actions, nullptr);
}
}  // namespace d2s1r::pf
