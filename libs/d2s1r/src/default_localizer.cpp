// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "default_localizer.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>

#include "answer/distinct_poses.h"
#include "base/scoped_timer.h"
#include "fine/refinement.h"

namespace d2s1r
{
namespace
{
/// Returns whether an answer leaves much less doubt than a localized frame may.
bool is_clear(const Localization& answer, const ScoringParameters& parameters)
{
	constexpr double kDoubt = 0.1;  // [-] share of what it may leave
	return 1 - answer.confidence < kDoubt * (1 - parameters.localized_above);
}

/// Returns the cost [step] of the cheapest candidate at the place of an answer; infinity if there is none.
double cost_of(const Decision& decision, const Scan& scan, const Found& found, const ScoringParameters& parameters)
{
	if (decision.answer.hypotheses.empty()) return HUGE_VAL;
	const mrpt::math::TPose2D sensor = decision.answer.best().pose.asTPose() + scan.sensor_on_robot;
	const auto is_there = [&](const Candidate& candidate)
	{
		return found.readings[candidate.reading].map == decision.maps.front() &&
		       are_near(candidate.pose, sensor, parameters.distinct_distance, mrpt::DEG2RAD(parameters.distinct_yaw));
	};
	const auto cheapest = std::find_if(found.candidates.begin(), found.candidates.end(), is_there);
	return cheapest == found.candidates.end() ? HUGE_VAL : cheapest->cost;
}

/// Returns the cost [step] below which a look left no candidate out.
double complete_below(const Found& found, const CoarseSearchParameters& limits, double margin)
{
	const bool is_full = static_cast<int>(found.candidates.size()) >= limits.candidates;
	return is_full ? found.candidates.back().cost : found.candidates.front().cost + margin;
}

/// The time that a query may take.
class TimeBudget
{
   public:
	/// \param budget [ms] 0: as much as it takes
	explicit TimeBudget(double budget) : budget_ms_(budget > 0 ? budget : HUGE_VAL) {}

	bool is_half_spent() const { return left_ms() < 0.5 * budget_ms_; }

	/// Judges as many candidates as the time allows of which the `following` searches [-] shall have an equal share.
	template <class Judge>
	std::vector<Place> judge(
	    const Judge& judge, const std::vector<Candidate>& candidates, const Parameters& limits,
	    std::ptrdiff_t following) const
	{
		const double budget = left_ms() / static_cast<double>(1 + following);
		const auto affordable = affordable_candidates(budget, candidates, limits, judge);
		return judge(affordable.candidates, affordable.parameters);
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
    const std::vector<Candidate>& candidates, const SearchedReadings& readings, const Parameters& limits, Work& work)
{
	const BeamSubset few = few_beams(work.scan), many = many_beams(work.scan), all = all_beams(work.scan);
	const RefinementParameters& refinement = limits.refinement;
	StageTimes& times = work.times;
	const auto settled = timed(times.registration_ms, settle, readings, few, candidates, refinement);
	const auto shortlist = timed(times.refinement_ms, make_shortlist, readings, few, settled, refinement);
	const auto poses = timed(times.refinement_ms, refine, readings, many, shortlist, refinement);
	return timed(times.refinement_ms, find_places, readings, work.scan, all, poses, limits);
}

Decision answer_of(
    const std::vector<SearchedMap>& maps, const std::vector<Found>& found, const Parameters& limits, Work& work)
{
	std::vector<Place> places;
	for (const Found& here : found)
	{
		const auto judge = [&](const auto& some, const auto& with)
		{ return places_among(some, here.readings, with, work); };
		const auto some = work.budget.judge(judge, here.candidates, limits, &found.back() - &here);
		places = merged_places(std::move(places), some, limits.scoring);
	}
	return timed(work.times.refinement_ms, conclude, work.scan, maps, places);
}

std::vector<Found> candidates_of(SearchOfMaps& search, const Parameters& limits, Work& work)
{
	const ScopedTimer timer(work.times.retrieval_ms);
	return search.found(limits.coarse_search);
}

/// Answers with a part of the candidates and of the effort. The answer stands if it is clear and if what was left out
/// costs so much more than the candidate at its place that it is none of the places that explain the scan best. No
/// value otherwise.
std::optional<Decision> first_look(
    const std::vector<SearchedMap>& maps, const Parameters& whole, SearchOfMaps& search, Work& work)
{
	constexpr double kLess =
	    0.5;  // [-] share of the margin by which the answer's place costs less than what was left out
	if (whole.first_look.effort >= 1) return std::nullopt;
	const Parameters limits = for_first_look(whole);
	const std::vector<Found> found = candidates_of(search, limits, work);
	if (found.front().candidates.empty()) return std::nullopt;
	const double complete = complete_below(found.front(), limits.coarse_search, search.margin(limits.coarse_search));
	const double most = complete - kLess * search.margin(whole.coarse_search);
	if (found.front().candidates.front().cost > most) return std::nullopt;
	const auto is_sure = [&](const Decision& decision)
	{
		return is_clear(decision.answer, limits.scoring) &&
		       cost_of(decision, work.scan, found.front(), limits.scoring) <= most;
	};
	Decision decision = answer_of(maps, found, limits, work);
	decision.answer.times = work.times;
	if (work.budget.is_half_spent() || is_sure(decision)) return decision;
	return std::nullopt;
}
}  // namespace

Decision localize_default(const Scan& scan, const std::vector<SearchedMap>& maps, double time_budget)
{
	Work work{scan, TimeBudget(time_budget), {}};
	const Parameters whole = limits_of_search(maps.front().parameters, maps.size());
	const auto begin = [&] { return SearchOfMaps(maps, scan, whole.coarse_search); };
	SearchOfMaps search = timed(work.times.retrieval_ms, begin);
	if (std::optional<Decision> first = first_look(maps, whole, search, work)) return *first;
	Decision decision = answer_of(maps, candidates_of(search, whole, work), whole, work);
	decision.answer.times = work.times;
	return decision;
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
		places = merged_places(std::move(places), places_among(here, reading, lenient, work), lenient.scoring);
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
	constexpr std::size_t kSample = 16;  // [-] one candidate in this many shows what one costs
	constexpr double kReserve = 0.8;     // [-] share of the time left that is planned with
	const std::size_t least = candidates.size() / kSample;
	if (least == 0 || std::isinf(budget)) return {std::move(candidates), parameters};
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
