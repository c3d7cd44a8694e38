// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "fine/decision.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "answer/distinct_poses.h"

namespace d2s1r
{
namespace
{
using mrpt::math::TPose2D;

/// Returns the temperature: the number by which a difference of log-likelihoods is divided to get log-odds. The more
/// beams contradict the map at the best place, the more of the difference is chance.
double temperature(const Place& best, const ScoringParameters& parameters)
{
	const double of_scan = parameters.temperature + parameters.temperature_by_beam * best.score.contradicted;
	return (1 + parameters.temperature_by_tolerance * best.field().tolerance()) * of_scan;
}

/// Returns the log-odds of the best place against another one, by the beams.
double lead_of(const Place& best, const Place& place, const ScoringParameters& parameters)
{
	return (best.score.log_likelihood - place.score.log_likelihood) / temperature(best, parameters);
}

/// Returns the likelihood [0, 1] of a place relative to that of the best one, tempered: by the beams or by the pieces
/// of surface, whichever favours it more. A map that is exact and one that is bent must both tell the places apart.
double weight_of(const Place& place, const Place& best, const ScoringParameters& parameters)
{
	const double by_pieces = (*best.by_pieces - *place.by_pieces) / temperature(best, parameters);
	return std::exp(-std::max(0.0, std::min(by_pieces, lead_of(best, place, parameters))));
}

void sort_best_first(std::vector<Place>& poses)
{
	std::stable_sort(
	    poses.begin(), poses.end(),
	    [](const Place& a, const Place& b) { return a.score.log_likelihood > b.score.log_likelihood; });
}

/// Weighs the places, best first, by all beams and by the pieces of surface.
void weigh(const BeamSubset& all, const ScoringParameters& parameters, std::vector<Place>& places)
{
	for (Place& place : places)
	{
		const BeamModel& model = place.parameters().scoring.beam_model;
		if (!place.by_pieces)
			place.by_pieces = log_likelihood_by_pieces(place.tracer(), place.field(), all, place.scored_at, model);
		place.weight = weight_of(place, places.front(), parameters);
	}
}

/// Returns the poses, best first; of those at one place it keeps the best, and gives it its weight.
/// \param all the beams that the poses were scored with
std::vector<Place> distinct_places(std::vector<Place> poses, const BeamSubset& all, const ScoringParameters& parameters)
{
	sort_best_first(poses);
	DistinctPoses distinct(kPlaceDistance, kPlaceYaw);
	std::vector<Place> places;
	for (Place& pose : poses)
		if (distinct.add(pose.pose, pose.map->number)) places.push_back(pose);
	weigh(all, parameters, places);
	return places;
}

/// Returns the log-odds that a place is right, by how the scan fits there alone.
double log_odds_of_fit(const Score& score, const PresenceModel& model)
{
	return model.bias + model.beam * score.returns + model.unknown_metre * score.unknown_metres +
	       model.log_likelihood * score.log_likelihood + model.surfaces * std::log1p(score.segments);
}

/// Returns the log-odds that one of the places found in a map is right.
/// \param second best place of the map; null if there is none
double log_odds_of_presence(const Place& best, const Place* second, const ScoringParameters& parameters)
{
	const PresenceModel& model = parameters.presence_model;
	const double lead = second ? lead_of(best, *second, parameters) : kMostLead;
	return log_odds_of_fit(best.score, model) + log_odds_of_lead(lead, model);
}

/// What the places found in a map tell of it.
struct MapEvidence
{
	const Place* best = nullptr;    //!< null: no place was found
	const Place* second = nullptr;  //!< null: there is only one
	double mass = 0;                //!< [-] sum of the weights of its places
	double log_odds = 0;            //!< that one of them is right
};

std::vector<MapEvidence> evidence_by_map(const std::vector<Place>& places, const std::vector<SearchedMap>& maps)
{
	std::vector<MapEvidence> evidence(maps.size());
	for (const Place& place : places)
	{
		MapEvidence& of_map = evidence[place.map->number];
		of_map.mass += place.weight;
		if (!of_map.best)
			of_map.best = &place;
		else if (!of_map.second)
			of_map.second = &place;
	}
	for (std::size_t map = 0; map < evidence.size(); map++)
		if (evidence[map].best)
			evidence[map].log_odds =
			    log_odds_of_presence(*evidence[map].best, evidence[map].second, maps[map].parameters.scoring);
	return evidence;
}

/// Returns by what the odds of each of so many maps [-] are multiplied. The scan is of one of them at most, and the
/// more maps there are, the more places seem right by chance.
double prior_odds(std::size_t maps)
{
	return 1 / std::sqrt(static_cast<double>(maps));
}

/// Returns the odds [-] that the beams are in the wrong order, against one of the places being right.
/// \param mirrored [nat] log-likelihood of the mirrored scan
double odds_of_mirror(double mirrored, const Place& best)
{
	constexpr double kPrior = 1e-3;  // [-] odds before one looks: of one scan in a thousand
	return kPrior * std::exp((mirrored - best.score.log_likelihood) / temperature(best, best.parameters().scoring));
}

/// Returns whether many returns are specks, such as dust, rain and a dirty laser make, and another place explains about
/// as many returns as the best one. The beam model charges each speck as an object, so that the true place looks very
/// unlikely, and by chance a place looks likelier where beams pass through walls instead. In such a scan the number of
/// explained returns decides: the lead must be greater than two standard deviations of what chance makes of it.
bool may_be_elsewhere(const Scan& scan, const std::vector<Place>& places)
{
	constexpr double kDeviations = 2;     // [-]
	constexpr double kLoneReturns = 0.2;  // [-] share of the returns
	const Score& best = places.front().score;
	const double chance = kDeviations * std::sqrt(best.explained * (1 - best.explained) / best.returns);
	const auto explains_as_much = [&](const Place& place) { return place.score.explained > best.explained - chance; };
	return std::any_of(places.begin() + 1, places.end(), explains_as_much) &&
	       share_of_lone_returns(scan) > kLoneReturns;
}

/// A place and its probability [0, 1].
struct Likely
{
	const Place* place;
	double probability;
};

/// What all places together tell.
struct Probabilities
{
	double presence = 0;         //!< [0, 1] that one of the places is right
	std::vector<Likely> places;  //!< the most probable first
};

Probabilities probabilities_of(
    const Scan& scan, const std::vector<Place>& places, const std::vector<SearchedMap>& maps, double mirrored)
{
	const std::vector<MapEvidence> evidence = evidence_by_map(places, maps);
	double mass = 0, greatest = -std::numeric_limits<double>::infinity();
	for (const MapEvidence& of_map : evidence)
	{
		mass += of_map.mass;
		if (of_map.best) greatest = std::max(greatest, of_map.log_odds);
	}
	double mean_odds = 0;  // [-] relative to the greatest ones
	for (const MapEvidence& of_map : evidence)
		if (of_map.best) mean_odds += of_map.mass / mass * std::exp(of_map.log_odds - greatest);
	const double odds_of_absence = std::exp(-greatest) / (mean_odds * prior_odds(evidence.size()));
	Probabilities result;
	result.presence = 1 / (1 + odds_of_absence + odds_of_mirror(mirrored, places.front()));
	if (may_be_elsewhere(scan, places))
		result.presence = std::min(result.presence, places.front().parameters().scoring.localized_above);
	for (const Place& place : places)
	{
		const double of_map = std::exp(evidence[place.map->number].log_odds - greatest) / mean_odds;
		result.places.push_back({&place, result.presence * place.weight / mass * of_map});
	}
	std::stable_sort(
	    result.places.begin(), result.places.end(),
	    [](const Likely& a, const Likely& b) { return a.probability > b.probability; });
	return result;
}

/// Returns whether the map and its prior allow a robot whose sensor has this pose.
bool is_possible(const PoseInMap& sensor, const Scan& scan)
{
	const TPose2D robot_on_sensor = TPose2D() - scan.sensor_on_robot;
	return sensor.tracer().may_stand(sensor.pose) && sensor.map->prior.allows(sensor.pose + robot_on_sensor);
}

Score score_of(const PoseInMap& sensor, const BeamSubset& all)
{
	return score(sensor.tracer(), sensor.field(), all, sensor.pose, sensor.parameters().scoring.beam_model);
}

/// Scores the poses that are possible.
/// \return best first
std::vector<Place> scored_places(const Scan& scan, const BeamSubset& all, const std::vector<RefinedPose>& poses)
{
	std::vector<Place> scored;
	for (const PoseInMap& pose : poses)
		if (is_possible(pose, scan)) scored.push_back({pose, score_of(pose, all), pose.pose});
	sort_best_first(scored);
	return scored;
}

/// Polishes the best of `scored`, best first, and scores them anew.
void polish_best(const Scan& scan, const BeamSubset& all, std::size_t most, std::vector<Place>& scored)
{
	const double least = scored.empty() ? 0 : scored.front().score.log_likelihood - kHopeless;
	for (std::size_t i = 0; i < std::min(scored.size(), most) && scored[i].score.log_likelihood >= least; i++)
	{
		if (std::exchange(scored[i].is_polished, true)) continue;
		PoseInMap polished = scored[i];
		polished.pose = polish(polished.field(), all, polished.pose, polished.parameters().refinement);
		if (!is_possible(polished, scan)) continue;
		scored[i].pose = polished.pose;
		const Score score = score_of(polished, all);
		if (score.log_likelihood <= scored[i].score.log_likelihood) continue;
		scored[i].score = score;
		scored[i].scored_at = polished.pose;
		scored[i].by_pieces.reset();
	}
}

/// Gives the best of `places`, best first, the best score that is found near them.
void compare_best(const BeamSubset& all, std::size_t most, std::vector<Place>& places)
{
	constexpr double kNegligible = 1e-3;  // [-] a place of this weight is not compared
	for (std::size_t i = 0; i < std::min(places.size(), most) && places[i].weight > kNegligible; i++)
	{
		Place& place = places[i];
		if (std::exchange(place.is_compared, true)) continue;
		const ScoredPose best =
		    best_score_near(place.tracer(), place.field(), all, place.pose, place.parameters().scoring.beam_model);
		if (best.score.log_likelihood <= place.score.log_likelihood) continue;
		place.score = best.score;
		place.scored_at = best.pose;
		place.by_pieces.reset();
	}
}
}  // namespace

double log_odds_of_lead(double lead, const PresenceModel& model)
{
	return model.lead * std::min(kMostLead, lead);
}

std::vector<Place> find_places(
    const Scan& scan, const BeamSubset& all, const std::vector<RefinedPose>& poses, const Parameters& limits,
    const std::vector<Place>& known)
{
	std::vector<Place> places = scored_places(scan, all, poses);
	places.insert(places.end(), known.begin(), known.end());
	sort_best_first(places);
	polish_best(scan, all, most_poses(Stage::kPolished, limits.refinement), places);
	places = distinct_places(std::move(places), all, limits.scoring);
	compare_best(all, most_poses(Stage::kCompared, limits.refinement), places);
	places = distinct_places(std::move(places), all, limits.scoring);
	return places;
}

void add_covariances(const BeamSubset& all, const ScoringParameters& limits, std::vector<Place>& places)
{
	const std::size_t listed = std::min(places.size(), static_cast<std::size_t>(limits.hypotheses));
	for (std::size_t i = 0; i < listed; i++)
	{
		Place& place = places[i];
		place.covariance = pose_covariance(place.field(), all, place.pose, place.parameters().refinement);
	}
}

Decision decide(
    const Scan& scan, const std::vector<Place>& places, const std::vector<SearchedMap>& maps, double mirrored)
{
	Decision result;
	result.answer = no_place(Status::kRejected, "no place in the map explains the scan");
	if (places.empty()) return result;
	if (mirrored > places.front().score.log_likelihood)
		result.answer.note = "the map explains the mirrored scan better: is the laser mounted upside down?";
	const auto [presence, likely] = probabilities_of(scan, places, maps, mirrored);
	result.answer.presence = presence;
	result.answer.temperature = temperature(places.front(), places.front().parameters().scoring);
	result.best = static_cast<std::size_t>(likely.front().place - places.data());
	const ScoringParameters& scoring = places[result.best].parameters().scoring;
	if (result.answer.presence < scoring.rejected_below) return result;
	result.answer.note.clear();
	const auto most = static_cast<std::size_t>(scoring.hypotheses);
	for (std::size_t i = 0; i < likely.size() && result.maps.size() < most; i++)
	{
		const Place& place = *likely[i].place;
		if (i > 0 && place.covariance.isZero(0)) continue;  // only the odds of its map put it this far
		const mrpt::math::CMatrixDouble33 covariance(place.covariance);
		Hypothesis hypothesis = hypothesis_of_sensor(place.pose, covariance, scan.sensor_on_robot);
		hypothesis.covariance += motion_covariance(scan);
		hypothesis.probability = likely[i].probability;
		hypothesis.log_likelihood = place.score.log_likelihood;
		hypothesis.by_pieces = place.by_pieces;
		hypothesis.explained = place.score.explained;
		hypothesis.log_odds = log_odds_of_fit(place.score, place.parameters().scoring.presence_model);
		result.answer.hypotheses.push_back(hypothesis);
		result.maps.push_back(place.map->number);
	}
	result.answer.confidence = result.answer.best().probability;
	result.answer.status = result.answer.confidence > scoring.localized_above ? Status::kLocalized : Status::kAmbiguous;
	return result;
}
}  // namespace d2s1r
