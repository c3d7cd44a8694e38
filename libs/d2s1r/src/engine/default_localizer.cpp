// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "engine/default_localizer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "answer/distinct_poses.h"
#include "base/scoped_timer.h"
#include "fine/refinement.h"

namespace d2s1r
{
namespace
{
/// What the candidates that were judged tell.
struct Look
{
	Decision decision;
	std::vector<std::vector<Place>> places;  //!< by what is refined at once (Found), best first
	double localized_above = 0;              //!< [probability] of the map of the best place
	bool is_partial = false;                 //!< candidates were left out that the whole search has
	bool is_safe = false;  //!< those cost so much that none of them can be the true place instead of the answer
};

/// Returns the limits of the looks that are made, one after the other, until the answer is clear.
std::vector<Parameters> looks(const Parameters& whole)
{
	if (whole.first_look.effort >= 1) return {whole};
	return {for_first_look(whole), whole};
}

/// Returns whether an answer leaves much less doubt than a localized frame may.
/// \param localized_above [probability] of the map of its best place
bool is_clear(const Localization& answer, double localized_above)
{
	constexpr double kDoubt = 0.1;  // [-] share of what it may leave
	return 1 - answer.confidence < kDoubt * (1 - localized_above);
}

/// Returns the cost [step] of the cheapest candidate at the place of an answer; infinity if there is none.
double cost_of(const Decision& decision, const Scan& scan, const Found& found)
{
	if (decision.answer.hypotheses.empty()) return HUGE_VAL;
	const mrpt::math::TPose2D sensor = decision.answer.best().pose.asTPose() + scan.sensor_on_robot;
	const auto is_there = [&](const Candidate& candidate)
	{
		return found.readings[candidate.reading].map == decision.maps.front() &&
		       are_near(candidate.pose, sensor, kPlaceDistance, kPlaceYaw);
	};
	const auto cheapest = std::find_if(found.candidates.begin(), found.candidates.end(), is_there);
	return cheapest == found.candidates.end() ? HUGE_VAL : cheapest->cost;
}

/// Makes a localized answer ambiguous.
/// \param localized_above [probability] of the map of its best place
void doubt(Localization& answer, double localized_above)
{
	if (answer.status != Status::kLocalized) return;
	const double share = localized_above / answer.confidence;
	for (Hypothesis& hypothesis : answer.hypotheses)
		hypothesis.probability = std::min(share * hypothesis.probability, localized_above);
	answer.confidence = answer.best().probability;
	answer.status = Status::kAmbiguous;
}

/// The time that a query may take.
class TimeBudget
{
   public:
	/// \param budget [ms] 0: as much as it takes
	explicit TimeBudget(double budget) : budget_ms_(budget > 0 ? budget : HUGE_VAL) {}

	bool is_half_spent() const { return left_ms() < 0.5 * budget_ms_; }

	/// Returns as many candidates as can be judged in the time that is left, of which the `following` readings [-]
	/// shall have an equal share.
	template <class Judge>
	AffordableCandidates affordable(
	    const Judge& judge, const std::vector<Candidate>& candidates, const Parameters& limits,
	    std::ptrdiff_t following) const
	{
		return affordable_candidates(left_ms() / static_cast<double>(1 + following), candidates, limits, judge);
	}

   private:
	double left_ms() const { return budget_ms_ - 1e3 * watch_.Tac(); }

	double budget_ms_;
	mrpt::system::CTicTac watch_;
};

/// What a query works with, and the time that its stages take.
struct Work
{
	const Scan& scan;
	TimeBudget budget;
	StageTimes times;
};

/// Says what the places tell.
Decision conclude(const Scan& scan, const std::vector<SearchedMap>& maps, const std::vector<Place>& places)
{
	std::vector<const Parameters*> parameters;
	for (const SearchedMap& map : maps) parameters.push_back(&map.parameters);
	Decision result = decide(scan, places, parameters);
	const auto is_bounded = [](const SearchedMap& map) { return !map.prior.anywhere(); };
	if (result.answer.status == Status::kRejected && std::any_of(maps.begin(), maps.end(), is_bounded))
		result.answer.note = "no place in the given region explains the scan";
	return result;
}

// The whole method: from candidates to places, from all readings of the maps to an answer, and one look after the
// other.
std::vector<Place> places_among(
    const std::vector<Candidate>& candidates, const SearchedReadings& readings, const Parameters& limits,
    const std::vector<Place>& known, Work& work)
{
	const BeamSubset few = few_beams(work.scan), many = many_beams(work.scan), all = all_beams(work.scan);
	const RefinementParameters& refinement = limits.refinement;
	StageTimes& times = work.times;
	const auto settled = timed(times.registration_ms, settle, readings, few, candidates, refinement);
	const auto shortlist = timed(times.refinement_ms, make_shortlist, readings, few, settled, refinement);
	const auto poses = timed(times.refinement_ms, refine, readings, many, shortlist, refinement);
	return timed(times.refinement_ms, find_places, readings, work.scan, all, poses, limits, known);
}

Look look_at(
    const std::vector<SearchedMap>& maps, const std::vector<Found>& found, const Parameters& limits, double less,
    const Look& before, Work& work)
{
	Look look;
	double complete_below = found.front().complete_below;
	std::vector<Place> places;
	for (std::size_t i = 0; i < found.size(); i++)
	{
		const Found& here = found[i];
		// What is measured must not be what is known already.
		const auto judge_anew = [&](const auto& some, const auto& with)
		{ return places_among(some, here.readings, with, {}, work); };
		const auto some = work.budget.affordable(judge_anew, here.candidates, limits, &found.back() - &here);
		const auto known = before.places.empty() ? std::vector<Place>() : before.places[i];
		look.places.push_back(places_among(some.candidates, here.readings, some.parameters, known, work));
		places = merged_places(std::move(places), look.places.back(), limits.scoring);
		if (some.candidates.size() == here.candidates.size()) continue;
		look.is_partial = true;
		complete_below = std::min(complete_below, here.candidates[some.candidates.size()].cost);
	}
	look.decision = timed(work.times.refinement_ms, conclude, work.scan, maps, places);
	const std::size_t of_best = look.decision.maps.empty() ? 0 : look.decision.maps.front();
	look.localized_above = maps[of_best].parameters.scoring.localized_above;
	look.is_safe = cost_of(look.decision, work.scan, found.front()) + less <= complete_below;
	return look;
}
}  // namespace

Decision localize_default(const Scan& scan, const std::vector<SearchedMap>& maps, double time_budget)
{
	Work work{scan, TimeBudget(time_budget), {}};
	const std::vector<Parameters> all = looks(limits_of_search(maps));
	const auto begin = [&] { return SearchOfMaps(maps, scan, all.back().coarse_search); };
	SearchOfMaps search = timed(work.times.retrieval_ms, begin);
	const double less = (1 - kFirstShare) * search.margin();
	Look look;
	for (const Parameters& limits : all)
	{
		const bool is_last = &limits == &all.back();
		const auto find = [&] { return search.found(limits.coarse_search); };
		const std::vector<Found> found = timed(work.times.retrieval_ms, find);
		const auto& [readings, candidates, complete_below] = found.front();
		if (!is_last && (candidates.empty() || candidates.front().cost + less > complete_below)) continue;
		look = look_at(maps, found, limits, less, look, work);
		look.is_partial |= !is_last;
		if (work.budget.is_half_spent() || (look.is_safe && is_clear(look.decision.answer, look.localized_above)))
			break;
	}
	if (look.is_partial && !look.is_safe) doubt(look.decision.answer, look.localized_above);
	look.decision.answer.times = work.times;
	return std::move(look.decision);
}

std::optional<Localization> refusal_of(const Scan& scan, const ScanParameters& parameters)
{
	if (!scan.valid()) return no_place(Status::kInvalid, why_invalid(scan));
	if (!is_covered(scan, parameters)) return std::nullopt;
	return no_place(Status::kRejected, "nine of ten beams end within scan.covered_within: the sensor is covered");
}

std::optional<Hypothesis> hypothesis_near(
    const Scan& scan, const DefaultIndex& index, const mrpt::math::TPose2D& robot, const Parameters& parameters)
{
	Parameters lenient = parameters;
	lenient.scoring.rejected_below = 0;
	const std::vector<Candidate> here{Candidate{robot + scan.sensor_on_robot}};
	Work work{scan, TimeBudget(0), {}};
	std::vector<Place> places;
	const Prior anywhere;
	for (const auto& [field, tracer] : index.readings)
	{
		const SearchedReadings reading = {{field, tracer, lenient, anywhere, 0}};
		places = merged_places(std::move(places), places_among(here, reading, lenient, {}, work), lenient.scoring);
	}
	const Localization result = decide(scan, places, lenient);
	if (result.hypotheses.empty()) return std::nullopt;
	Hypothesis hypothesis = result.best();
	hypothesis.probability = 0;
	return hypothesis;
}

AffordableCandidates affordable_candidates(
    double budget, std::vector<Candidate> candidates, const Parameters& parameters,
    const std::function<void(const std::vector<Candidate>&, const Parameters&)>& judge)
{
	constexpr std::size_t kSample = 16;  // [-] one in this many of the most candidates shows what one costs
	constexpr double kReserve = 0.8;     // [-] share of the time left that is planned with
	const std::size_t least = static_cast<std::size_t>(parameters.coarse_search.candidates) / kSample;
	if (least == 0 || candidates.size() <= least || std::isinf(budget)) return {std::move(candidates), parameters};
	const auto all = static_cast<double>(candidates.size()), sample = static_cast<double>(least);
	const std::vector<Candidate> first(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(least));
	double spent_ms = 0;
	{
		const ScopedTimer timer(spent_ms);
		judge(first, with_share_of_effort(parameters, sample / all));
	}
	const double affordable = std::clamp(kReserve * (budget - spent_ms) / spent_ms * sample, sample, all);
	candidates.resize(static_cast<std::size_t>(affordable));
	return {std::move(candidates), with_share_of_effort(parameters, affordable / all)};
}
}  // namespace d2s1r
