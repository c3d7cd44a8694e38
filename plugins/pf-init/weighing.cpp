// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "weighing.h"

#include <d2s1r/likelihood_field.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

#include "particle_place.h"
#include "prediction.h"

namespace d2s1r::pf
{
namespace
{
/// Returns whether the filter's place explains enough of a scan that no place of the map explains well. Such a scan
/// would draw particles that are elsewhere to the next wall.
bool explains(
    const mrpt::poses::CPosePDFParticles& particles, const MapRow& maps, const mrpt::obs::CObservation2DRangeScan& scan,
    const Tuning& tuning)
{
	const auto& options = maps.likelihood_options();
	const Scan beams = make_scan(scan_of(scan), maps.parameters().scan);
	const auto points = end_points(beams, options.beams);
	if (points.empty() || is_covered(beams, maps.parameters().scan)) return false;
	const auto place = dominant_place(particles, normalized_weights(particles));
	const double of_nothing =
	    std::min(options.independent_beams, static_cast<double>(points.size())) * std::log(options.random_share);
	return maps.log_likelihood(points, place.pose) >= (1 - tuning.least_explained) * of_nothing;
}
}  // namespace

double probability_found(const Localization& localization)
{
	double sum = 0;
	for (const Hypothesis& hypothesis : localization.hypotheses) sum += hypothesis.probability;
	return std::min(1.0, sum);
}

mrpt::obs::CObservation2DRangeScan thinned(const mrpt::obs::CObservation2DRangeScan& scan, std::size_t beams)
{
	if (scan.getScanSize() <= beams) return scan;
	const std::size_t gaps = scan.getScanSize() - 1, stride = gaps / beams + 1, kept = gaps / stride + 1;
	mrpt::obs::CObservation2DRangeScan few = scan;
	few.resizeScan(kept);
	for (std::size_t i = 0; i < kept; i++)
	{
		few.setScanRange(i, scan.getScanRange(i * stride));
		few.setScanRangeValidity(i, scan.getScanRangeValidity(i * stride));
	}
	few.aperture = scan.aperture * static_cast<float>(stride * (kept - 1)) / static_cast<float>(gaps);
	// The scan loses beams at its end only, and the middle of what is left looks elsewhere.
	const double cut = 0.5 * static_cast<double>(scan.aperture - few.aperture);  // [rad]
	few.sensorPose = scan.sensorPose + mrpt::poses::CPose3D(0, 0, 0, scan.rightToLeft ? -cut : cut, 0, 0);
	return few;
}

bool weigh_by_prior(mrpt::poses::CPosePDFParticles& particles, const MapRow& maps)
{
	constexpr double kRuledOut = -50;  // [nat]
	bool is_any_left = false;
	for (auto& particle : particles.m_particles)
		if (maps.allows(particle.d))
			is_any_left = true;
		else
			particle.log_w += kRuledOut;
	return is_any_left;
}

void weigh_by_hypotheses(
    mrpt::poses::CPosePDFParticles& particles, const Localization& localization, const Tuning& tuning)
{
	if (localization.hypotheses.empty()) return;
	constexpr double kPerXy = 0.5 / (kSupportedDistance * kSupportedDistance);
	constexpr double kPerPhi = 0.5 / (kSupportedYaw * kSupportedYaw);
	for (auto& particle : particles.m_particles)
	{
		double support = tuning.unlisted;
		for (const Hypothesis& hypothesis : localization.hypotheses)
		{
			const double dx = particle.d.x - hypothesis.pose.x(), dy = particle.d.y - hypothesis.pose.y();
			const double dphi = mrpt::math::wrapToPi(particle.d.phi - hypothesis.pose.phi());
			const double exponent = kPerXy * (dx * dx + dy * dy) + kPerPhi * dphi * dphi;
			if (exponent < 10) support += hypothesis.probability * std::exp(-exponent);
		}
		particle.log_w += std::log(support);
	}
}

double weigh_by_scan_and_resample(
    mrpt::slam::CMonteCarloLocalization2D& particles, const MapRow& maps,
    const mrpt::obs::CObservation2DRangeScan& scan, const Localization& localization, const Tuning& tuning)
{
	const double found = probability_found(localization);
	if (found < kProbable && !explains(particles, maps, scan, tuning)) return particles.ESS();
	// As MRPT's executeOn() does, which knows one map only.
	std::vector<double> log_likelihoods;
	for (const auto& particle : particles.m_particles)
	{
		const mrpt::poses::CPose3D pose(maps.in_map(particle.d));
		log_likelihoods.push_back(maps.at(particle.d).map->computeObservationLikelihood(scan, pose));
	}
	const double best = *std::max_element(log_likelihoods.begin(), log_likelihoods.end());
	for (std::size_t i = 0; i < log_likelihoods.size(); i++)
	{
		const double below = log_likelihoods[i] - best;
		const double likelihood = found * std::exp(below) + (1 - found) * std::exp(tuning.unexplained_power * below);
		particles.m_particles[i].log_w += std::log(std::max(likelihood, 1e-300));
	}
	particles.normalizeWeights();
	const double effective = particles.ESS();
	const auto options = filter_of_fixed_size().m_options;
	if (effective < options.BETA) particles.performResampling(options);
	return effective;
}
}  // namespace d2s1r::pf
