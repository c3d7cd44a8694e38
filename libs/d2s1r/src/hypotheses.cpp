// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "hypotheses.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>

#include "distinct_poses.h"

namespace d2s1r
{
namespace
{
using mrpt::math::TPose2D;

struct Scored
{
	TPose2D pose;  //!< sensor in map
	Score score;
	double weight = 0;  //!< likelihood relative to the best pose
};

/// What a difference of log-likelihoods is divided by for log-odds: the more the best place leaves unexplained, the
/// more of the difference is chance.
double temperature(const Score& best, const ScoringParameters& parameters)
{
	return parameters.temperature + parameters.temperature_by_beam * best.unexplained;
}

void sort_best_first(std::vector<Scored>& poses)
{
	std::stable_sort(
	    poses.begin(), poses.end(),
	    [](const Scored& a, const Scored& b) { return a.score.log_likelihood > b.score.log_likelihood; });
}

/// Best first; of the poses at one place the best.
std::vector<Scored> distinct_places(std::vector<Scored> poses, const ScoringParameters& parameters)
{
	sort_best_first(poses);
	DistinctPoses distinct(parameters.distinct_distance, mrpt::DEG2RAD(parameters.distinct_yaw));
	std::vector<Scored> places;
	for (Scored& pose : poses)
	{
		const Score& best = poses.front().score;
		pose.weight = std::exp((pose.score.log_likelihood - best.log_likelihood) / temperature(best, parameters));
		if (distinct.add(pose.pose)) places.push_back(pose);
	}
	return places;
}

/// Probability that one of the places found is right.
double presence(const std::vector<Scored>& places, const PresenceModel& model)
{
	constexpr double kMostLead = 12;  // [-]
	const Score& best = places.front().score;
	const double lead = places.size() == 1 ? kMostLead : std::min(kMostLead, -std::log(places[1].weight));
	const double log_odds =
	    model.bias + model.explained * best.explained + model.in_front * std::min(best.in_front, best.explained) +
	    model.unexplained * best.unexplained + model.log_likelihood * best.log_likelihood + model.lead * lead +
	    model.depth_edges * std::log1p(best.depth_edges) + model.surfaces * std::log1p(best.surfaces);
	return 1 / (1 + std::exp(-log_odds));
}

/// Best first. Poses that may be the best one are polished before those at one place are reduced to the best of them,
/// and a place counts by the best score found at it: else a few centimetres would decide.
/// \param is_possible (sensor in map) whether that pose counts
template <class IsPossible>
std::vector<Scored> find_places(
    const BeamTracer& tracer, const DistanceField& field, const Rays& rays, const std::vector<RefinedPose>& poses,
    const IsPossible& is_possible, const Parameters& parameters)
{
	constexpr double kHopeless = 12;      // [nat] below the best pose: not polished
	constexpr double kNegligible = 1e-3;  // [-] likelihood relative to the best place: not compared
	const BeamModel& model = parameters.scoring.beam_model;
	std::vector<Scored> scored;
	for (const auto& [pose, fit] : poses)
		if (is_possible(pose)) scored.push_back({pose, score(tracer, field, rays, pose, model)});
	sort_best_first(scored);
	const double least = scored.empty() ? 0 : scored.front().score.log_likelihood - kHopeless;
	const std::size_t to_polish = std::min(scored.size(), static_cast<std::size_t>(parameters.refinement.max_polished));
	for (std::size_t i = 0; i < to_polish && scored[i].score.log_likelihood >= least; i++)
	{
		const TPose2D pose = polish(field, rays, scored[i].pose, parameters.refinement);
		if (!is_possible(pose)) continue;
		scored[i].pose = pose;
		const Score polished = score(tracer, field, rays, pose, model);
		if (polished.log_likelihood > scored[i].score.log_likelihood) scored[i].score = polished;
	}
	std::vector<Scored> places = distinct_places(std::move(scored), parameters.scoring);
	const std::size_t to_compare =
	    std::min(places.size(), static_cast<std::size_t>(parameters.refinement.max_compared));
	for (std::size_t i = 0; i < to_compare && places[i].weight > kNegligible; i++)
	{
		const Score best = best_score_near(tracer, field, rays, places[i].pose, model);
		if (best.log_likelihood > places[i].score.log_likelihood) places[i].score = best;
	}
	return distinct_places(std::move(places), parameters.scoring);
}
}  // namespace

std::vector<RefinedPose> choose_promising(
    const BeamTracer& tracer, const DistanceField& field, const Rays& few, const std::vector<RefinedPose>& poses,
    const Parameters& parameters)
{
	// (- log-likelihood, pose): best first, ties by fit
	using Ranking = std::vector<std::pair<double, std::size_t>>;
	const BeamModel& model = parameters.scoring.beam_model;
	const auto most = static_cast<std::size_t>(parameters.refinement.max_refined);
	Ranking by_most;
	for (std::size_t i = 0; i < poses.size(); i++)
		by_most.emplace_back(-log_likelihood_bound(tracer, field, few, poses[i].pose, model), i);
	std::sort(by_most.begin(), by_most.end());
	Ranking ranking;
	for (const auto& [least_cost, i] : by_most)
	{
		constexpr double kRounding = 1e-6;  // [nat]
		if (!ranking.empty() && least_cost > ranking.front().first + parameters.refinement.score_margin + kRounding)
			break;
		if (ranking.size() == most && least_cost > ranking.back().first + kRounding) break;
		const std::pair entry(-score(tracer, field, few, poses[i].pose, model).log_likelihood, i);
		ranking.insert(std::upper_bound(ranking.begin(), ranking.end(), entry), entry);
		if (ranking.size() > most) ranking.pop_back();
	}
	std::vector<RefinedPose> promising;
	for (const auto& [cost, i] : ranking)
		if (cost <= ranking.front().first + parameters.refinement.score_margin) promising.push_back(poses[i]);
	return promising;
}

Localization decide(
    const BeamTracer& tracer, const DistanceField& field, const Scan& scan, const Rays& rays,
    const std::vector<RefinedPose>& poses, const Prior& prior, const Parameters& parameters)
{
	const TPose2D robot_from_sensor = TPose2D() - scan.sensor_on_robot;
	const auto is_possible = [&](const TPose2D& sensor) { return prior.allows(sensor + robot_from_sensor); };
	const std::vector<Scored> places = find_places(tracer, field, rays, poses, is_possible, parameters);
	double mass = 0;
	for (const Scored& place : places) mass += place.weight;
	const double present = places.empty() ? 0 : presence(places, parameters.scoring.presence_model);
	if (places.empty() || present < parameters.scoring.rejected_below)
		return no_place(Status::kRejected, "no place in the map explains the scan");
	Localization result;
	const auto count = std::min(places.size(), static_cast<std::size_t>(parameters.scoring.hypotheses));
	for (std::size_t i = 0; i < count; i++)
	{
		const TPose2D& pose = places[i].pose;
		const mrpt::math::CMatrixDouble33 covariance(pose_covariance(field, rays, pose, parameters.refinement));
		Hypothesis hypothesis = hypothesis_of_sensor(pose, covariance, scan.sensor_on_robot);
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
