// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "default_localizer.h"

#include <algorithm>
#include <cmath>

#include "base/scoped_timer.h"
#include "fine/refinement.h"

namespace d2s1r
{
namespace
{
/// Returns the limits of the searches that are made, one after the other, until the answer is clear.
std::vector<Parameters> looks(const Parameters& parameters)
{
	if (parameters.first_look.effort >= 1) return {parameters};
	return {for_first_look(parameters), parameters};
}

/// Returns whether an answer needs no other look: it leaves much less doubt than a localized frame may.
bool is_clear(const Localization& answer, const ScoringParameters& parameters)
{
	constexpr double kDoubt = 0.1;  // [-] share of what it may leave
	return 1 - answer.confidence < kDoubt * (1 - parameters.localized_above);
}

/// Returns whether there may be candidates that a search with these limits leaves out: one of them may be the true
/// place, and then a wrong one that explains the scan as well seems to be the only one.
bool leaves_out(const std::vector<Found>& found, const CoarseSearchParameters& limits)
{
	const auto is_full = [&](const Found& here)
	{ return static_cast<int>(here.candidates.size()) >= limits.candidates; };
	return std::any_of(found.begin(), found.end(), is_full);
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
}  // namespace

Decision localize_default(const Scan& scan, const std::vector<SearchedMap>& maps, double time_budget)
{
	Work work{scan, TimeBudget(time_budget), {}};
	const std::vector<Parameters> all = looks(limits_of_search(maps.front().parameters, maps.size()));
	const auto begin = [&] { return SearchOfMaps(maps, scan, all.back().coarse_search); };
	SearchOfMaps search = timed(work.times.retrieval_ms, begin);
	std::optional<Decision> decision;
	for (const Parameters& limits : all)
	{
		const auto look = [&] { return search.found(limits.coarse_search); };
		const std::vector<Found> found = timed(work.times.retrieval_ms, look);
		if (&limits != &all.back() && leaves_out(found, limits.coarse_search)) continue;
		decision = answer_of(maps, found, limits, work);
		if (is_clear(decision->answer, limits.scoring) || work.budget.is_half_spent()) break;
	}
	decision->answer.times = work.times;  // the last look always has an answer
	return *decision;
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
