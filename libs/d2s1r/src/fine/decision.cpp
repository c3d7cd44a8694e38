// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "fine/decision.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>

#include "answer/distinct_poses.h"

namespace d2s1r
{
namespace
{
using mrpt::math::TPose2D;

/// Returns the temperature: the number by which a difference of log-likelihoods is divided to get log-odds. The more
/// the best place leaves unexplained, the more of the difference is chance.
double temperature(const Place& best, const ScoringParameters& parameters)
{
	constexpr double kByTolerance = 23;  // [1 / m]
	const double of_scan = parameters.temperature + parameters.temperature_by_beam * best.score.unexplained;
	return (1 + kByTolerance * best.tolerance) * of_scan;
}

void sort_best_first(std::vector<Place>& poses)
{
	std::stable_sort(
	    poses.begin(), poses.end(),
	    [](const Place& a, const Place& b) { return a.score.log_likelihood > b.score.log_likelihood; });
}

/// Returns the poses, best first; of those at one place it keeps the best, and gives it its weight.
std::vector<Place> distinct_places(std::vector<Place> poses, const ScoringParameters& parameters)
{
	sort_best_first(poses);
	DistinctPoses distinct(parameters.distinct_distance, mrpt::DEG2RAD(parameters.distinct_yaw));
	std::vector<Place> places;
	for (Place& pose : poses)
	{
		const Place& best = poses.front();
		pose.weight = std::exp((pose.score.log_likelihood - best.score.log_likelihood) / temperature(best, parameters));
		if (distinct.add(pose.pose)) places.push_back(pose);
	}
	return places;
}

/// Returns the probability [0, 1] that one of the places found is right.
double presence(const std::vector<Place>& places, const PresenceModel& model)
{
	constexpr double kMostLead = 12;  // [-] greatest log-odds that count
	const Score& best = places.front().score;
	const double lead = places.size() == 1 ? kMostLead : std::min(kMostLead, -std::log(places[1].weight));
	const double log_odds =
	    model.bias + model.explained * best.explained + model.in_front * std::min(best.in_front, best.explained) +
	    model.unexplained * best.unexplained + model.log_likelihood * best.log_likelihood + model.lead * lead +
	    model.depth_edges * std::log1p(best.depth_edges) + model.surfaces * std::log1p(best.segments);
	return 1 / (1 + std::exp(-log_odds));
}
}  // namespace

std::vector<Place> find_places(
    const BeamTracer& tracer, const DistanceField& field, const Scan& scan, const BeamSubset& all,
    const std::vector<RefinedPose>& poses, const Prior& prior, const Parameters& parameters)
{
	constexpr double kHopeless = 12;      // [nat] a pose this far below the best one is not polished
	constexpr double kNegligible = 1e-3;  // [-] a place of this weight is not compared
	const BeamModel& model = parameters.scoring.beam_model;
	const TPose2D robot_on_sensor = TPose2D() - scan.sensor_on_robot;
	const auto is_possible = [&](const TPose2D& sensor) { return prior.allows(sensor + robot_on_sensor); };
	std::vector<Place> scored;
	for (const auto& [pose, fit] : poses)
		if (is_possible(pose))
			scored.push_back({pose, score(tracer, field, all, pose, model), pose, field.tolerance()});
	sort_best_first(scored);
	const double least = scored.empty() ? 0 : scored.front().score.log_likelihood - kHopeless;
	const std::size_t to_polish = std::min(scored.size(), static_cast<std::size_t>(parameters.refinement.max_polished));
	for (std::size_t i = 0; i < to_polish && scored[i].score.log_likelihood >= least; i++)
	{
		const TPose2D pose = polish(field, all, scored[i].pose, parameters.refinement);
		if (!is_possible(pose)) continue;
		scored[i].pose = pose;
		const Score polished = score(tracer, field, all, pose, model);
		if (polished.log_likelihood > scored[i].score.log_likelihood)
		{
			scored[i].score = polished;
			scored[i].scored_at = pose;
		}
	}
	std::vector<Place> places = distinct_places(std::move(scored), parameters.scoring);
	const std::size_t to_compare =
	    std::min(places.size(), static_cast<std::size_t>(parameters.refinement.max_compared));
	for (std::size_t i = 0; i < to_compare && places[i].weight > kNegligible; i++)
	{
		const ScoredPose best = best_score_near(tracer, field, all, places[i].pose, model);
		if (best.score.log_likelihood > places[i].score.log_likelihood)
		{
			places[i].score = best.score;
			places[i].scored_at = best.pose;
		}
	}
	places = distinct_places(std::move(places), parameters.scoring);
	const std::size_t listed = std::min(places.size(), static_cast<std::size_t>(parameters.scoring.hypotheses));
	for (std::size_t i = 0; i < listed; i++)
		places[i].covariance = pose_covariance(field, all, places[i].pose, parameters.refinement);
	return places;
}

std::vector<Place> merged_places(std::vector<Place> a, std::vector<Place> b, const ScoringParameters& parameters)
{
	if (a.empty()) return b;
	a.insert(a.end(), b.begin(), b.end());
	return distinct_places(std::move(a), parameters);
}

Localization decide(const Scan& scan, const std::vector<Place>& places, const Parameters& parameters)
{
	double mass = 0;
	for (const Place& place : places) mass += place.weight;
	const double present = places.empty() ? 0 : presence(places, parameters.scoring.presence_model);
	if (places.empty() || present < parameters.scoring.rejected_below)
		return no_place(Status::kRejected, "no place in the map explains the scan");
	Localization result;
	const auto count = std::min(places.size(), static_cast<std::size_t>(parameters.scoring.hypotheses));
	for (std::size_t i = 0; i < count; i++)
	{
		const mrpt::math::CMatrixDouble33 covariance(places[i].covariance);
		Hypothesis hypothesis = hypothesis_of_sensor(places[i].pose, covariance, scan.sensor_on_robot);
		hypothesis.probability = present * places[i].weight / mass;
		hypothesis.log_likelihood = places[i].score.log_likelihood;
		hypothesis.explained = places[i].score.explained;
		result.hypotheses.push_back(hypothesis);
	}
	result.confidence = result.best().probability;
	result.status = result.confidence > parameters.scoring.localized_above ? Status::kLocalized : Status::kAmbiguous;
	return result;
}
}  // namespace d2s1r
