// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "recovery.h"

#include <d2s1r/likelihood_field.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "particle_place.h"
#include "weighing.h"

namespace d2s1r::pf
{
std::vector<std::size_t> lightest(const mrpt::poses::CPosePDFParticles& particles, std::size_t count)
{
	std::vector<std::size_t> order(particles.m_particles.size());
	for (std::size_t i = 0; i < order.size(); i++) order[i] = i;
	const auto scattered = [](std::size_t i) { return static_cast<std::uint32_t>(i * 2654435761U); };
	const auto lighter = [&](std::size_t a, std::size_t b)
	{
		const double weight_a = particles.m_particles[a].log_w, weight_b = particles.m_particles[b].log_w;
		return weight_a != weight_b ? weight_a < weight_b : scattered(a) < scattered(b);
	};
	count = std::min(count, order.size());
	std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(), lighter);
	order.resize(count);
	return order;
}

Recovery::Recovery(const MapRow& maps, const FusionParameters& parameters) : maps_(maps)
{
	seeding_.particles = parameters.filter.particles;
	seeding_.seed = parameters.seed;
}

bool Recovery::seed(mrpt::poses::CPosePDFParticles& particles, const Localization& localization)
{
	if (localization.hypotheses.empty()) return false;
	nowhere_ = 1 - probability_found(localization);
	assign_particles(particles, maps_.seed(localization, seeding_));
	return true;
}

double Recovery::probability_of_being_lost(
    const mrpt::poses::CPosePDFParticles& particles, const mrpt::obs::CObservation2DRangeScan& scan,
    const Localization& localization, const Tuning& tuning) const
{
	if (localization.hypotheses.empty()) return 0;
	if (probability_found(localization) < kProbable) return tuning.admitted_probability;
	const Scan beams = make_scan(scan_of(scan), maps_.parameters().scan);
	const auto points = end_points(beams, maps_.likelihood_options().beams);
	const auto log_likelihood = [&](const mrpt::math::TPose2D& pose) { return maps_.log_likelihood(points, pose); };
	double best = -std::numeric_limits<double>::infinity();  // [nat] of the hypotheses
	for (const Hypothesis& hypothesis : localization.hypotheses)
		best = std::max(best, std::log(hypothesis.probability + 1e-12) + log_likelihood(hypothesis.pose.asTPose()));
	const auto weights = normalized_weights(particles);
	double likelihood = 0;  // [-] of the scan, relative to that at the best hypothesis
	for (std::size_t i = 0; i < weights.size(); i++)
		likelihood += weights[i] * std::exp(log_likelihood(particles.m_particles[i].d) - best);
	likelihood = std::min(likelihood, likelihood_of_places(particles, beams, localization));
	const double of_lost = nowhere_ * std::exp(-tuning.takeover_margin), of_filter = (1 - nowhere_) * likelihood;
	return std::max(tuning.admitted_probability, of_lost / (of_lost + of_filter));
}

/// Returns how likely a scan is at the filter's places, relative to the best hypothesis, by the beam model of the
/// localizer: it sees the walls that beams would have to pass, whereas the likelihood field of the particles sees only
/// where beams end. Returns infinity if the beam model says nothing against the filter's places.
double Recovery::likelihood_of_places(
    const mrpt::poses::CPosePDFParticles& particles, const Scan& scan, const Localization& localization) const
{
	constexpr double kAny = std::numeric_limits<double>::infinity();
	if (maps_.parameters().method == Method::kPaper) return kAny;  // it has no beam model
	const auto weights = normalized_weights(particles);
	const Hypothesis& best = localization.best();
	double likelihood = 0;
	for (const Hypothesis& hypothesis : localization.hypotheses)
		likelihood +=
		    hypothesis.probability / best.probability * weight_near(particles, weights, hypothesis.pose.asTPose());
	if (likelihood > kProbable) return kAny;  // the filter may well be right
	const auto place = dominant_place(particles, weights);
	const auto of_place = maps_.hypothesis_near(scan, place.pose);
	const auto of_best = maps_.hypothesis_near(scan, best.pose.asTPose());
	if (!of_place || !of_best) return kAny;
	return likelihood + place.probability * std::exp(*of_place->log_likelihood - *of_best->log_likelihood);
}

void Recovery::admit(
    mrpt::poses::CPosePDFParticles& particles, const Localization& localization, double probability,
    mrpt::random::CRandomGenerator& random)
{
	if (localization.hypotheses.empty()) return;
	nowhere_ = probability * (1 - probability_found(localization));
	SeedingParameters few = seeding_;
	const double count = probability * static_cast<double>(particles.m_particles.size());
	few.particles = static_cast<int>(std::lround(count));
	if (few.particles < 1) return;
	few.seed = random.drawUniform32bit();
	const auto admitted = maps_.seed(localization, few);
	const auto replaced = lightest(particles, admitted.size());

	const auto weights = normalized_weights(particles);
	for (std::size_t i = 0; i < weights.size(); i++)
		particles.m_particles[i].log_w = std::log(std::max(weights[i], 1e-300)) + std::log1p(-probability);
	for (std::size_t i = 0; i < replaced.size(); i++)
	{
		particles.m_particles[replaced[i]].d = admitted[i].pose;
		particles.m_particles[replaced[i]].log_w = admitted[i].log_weight + std::log(probability);
	}
}
}  // namespace d2s1r::pf
