// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/motion.h>
#include <mrpt/obs/CActionCollection.h>

#include <algorithm>
#include <cmath>

#include "particle_place.h"
#include "prediction.h"

namespace d2s1r::pf
{
namespace
{
using mrpt::poses::CPosePDFGaussian;

CPosePDFGaussian widened_increment(const Hypothesis& from, const Hypothesis& to, const MotionParameters& parameters)
{
	CPosePDFGaussian increment = increment_between(from, to);
	const auto added = covariance_of(parameters.pseudo_xy, parameters.pseudo_xy, parameters.pseudo_phi);
	for (int i = 0; i < 3; i++) increment.cov(i, i) += added(i, i);
	return increment;
}

bool is_jump(const mrpt::poses::CPose2D& increment, const MotionParameters& parameters)
{
	return increment.norm() > parameters.farthest || std::abs(increment.phi()) > parameters.widest_turn;
}
}  // namespace

CPosePDFGaussian predict_motion(
    const std::optional<mrpt::poses::CPose2D>& odometry, const mrpt::poses::CPose2D& previous,
    const FilterParameters& parameters, const OdometryTuning& tuning)
{
	if (odometry) return odometry_motion(*odometry, tuning);
	return {previous, covariance_of(parameters.motion_along, parameters.motion_across, parameters.motion_turn)};
}

std::optional<CPosePDFGaussian> choose_motion(
    const MotionEvidence& evidence, const Support& support, const MotionParameters& parameters)
{
	const CPosePDFGaussian& predicted = evidence.predicted;
	std::optional<CPosePDFGaussian> best;
	double best_score = parameters.least_score;  // [nat] higher is better
	const double surprise = evidence.is_measured ? parameters.odometry_surprise : parameters.surprise;
	for (const Hypothesis& from : evidence.previous.hypotheses)
	{
		const double of_start = std::log(from.probability * (parameters.least_support + support(from)) + 1e-12);
		for (const Hypothesis& to : evidence.current.hypotheses)
		{
			const CPosePDFGaussian increment = widened_increment(from, to, parameters);
			const double error = mahalanobis_distance(predicted, increment);
			const bool is_surprise = error > parameters.gate;
			if (is_surprise && is_jump(increment.mean, parameters)) continue;
			const double score = of_start + std::log(to.probability + 1e-12) - std::min(0.5 * error * error, surprise);
			if (score <= best_score) continue;
			best_score = score;
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
