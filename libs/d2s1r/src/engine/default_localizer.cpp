// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "engine/default_localizer.h"

#include <mrpt/system/CTicTac.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "answer/distinct_poses.h"
#include "engine/search_effort.h"
#include "fine/refinement.h"

namespace d2s1r
{
namespace
{
/// Measures how much wall-clock time each stage takes.
class StageClock
{
   public:
	/// Adds the time since the last lap to that of a stage.
	void lap(double StageTimes::*stage_ms)
	{
		const double now_ms = 1e3 * watch_.Tac();
		times_.*stage_ms += now_ms - before_ms_;
		before_ms_ = now_ms;
	}

	const StageTimes& times() const { return times_; }

   private:
	mrpt::system::CTicTac watch_;
	double before_ms_ = 0;
	StageTimes times_;
};

/// The subsets of a scan's beams that the stages use.
struct BeamSubsets
{
	explicit BeamSubsets(const Scan& scan) : few(few_beams(scan)), many(many_beams(scan)), all(all_beams(scan)) {}

	BeamSubset few, many, all;
};

/// [-] Share of the poses for the searches that may only cast doubt on an answer: the place that they look for is among
/// the best ones.
constexpr double kLittleEffort = 0.03;

/// What a look has found.
struct Verdict
{
	std::vector<Place> places;  //!< best first
	Decision decision;
	bool is_whole = false;  //!< all candidates of the whole search were judged
	bool is_safe = false;   //!< all that were not cost far more than that of the answer

	/// Returns the pose of the sensor in map (m and rad) at the best place, if there is one.
	mrpt::math::TPose2D sensor(const Scan& scan) const
	{
		return decision.answer.best().pose.asTPose() + scan.sensor_on_robot;
	}
};

/// Returns the confidence [probability] that an answer must have to be localized, by the map of its best place.
double needed_confidence(const Decision& decision, const std::vector<SearchedMap>& maps)
{
	const std::size_t best = decision.maps.empty() ? 0 : decision.maps.front();
	return maps[best].parameters.scoring.localized_above;
}

/// Returns whether an answer leaves clearly less doubt than a localized frame may. See First look in
/// experiments/RESULTS.md.
bool is_clear(const Decision& decision, const std::vector<SearchedMap>& maps)
{
	constexpr double kDoubt = 0.5;  // [-] share of what it may leave
	return 1 - decision.answer.confidence < kDoubt * (1 - needed_confidence(decision, maps));
}

/// Returns whether an answer is localized, and a longer search would hardly change it.
bool may_stand(const Verdict& verdict, const std::vector<SearchedMap>& maps, bool is_last)
{
	return verdict.decision.answer.status == Status::kLocalized &&
	       (is_last || (verdict.is_safe && is_clear(verdict.decision, maps)));
}

/// Returns the cost [step] of the cheapest candidate at the place of an answer; infinity if there is none.
double cost_of(const Decision& decision, const Scan& scan, const std::vector<Candidate>& candidates)
{
	if (decision.answer.hypotheses.empty()) return HUGE_VAL;
	const mrpt::math::TPose2D sensor = decision.answer.best().pose.asTPose() + scan.sensor_on_robot;
	const auto is_there = [&](const Candidate& candidate)
	{
		return candidate.map->number == decision.maps.front() &&
		       are_near(candidate.pose, sensor, kPlaceDistance, kPlaceYaw);
	};
	const auto cheapest = std::find_if(candidates.begin(), candidates.end(), is_there);
	return cheapest == candidates.end() ? HUGE_VAL : cheapest->cost;
}

/// Returns those of `candidates` that are not among `judged`, both cheapest first.
std::vector<Candidate> without(const std::vector<Candidate>& judged, const std::vector<Candidate>& candidates)
{
	const auto is_cheaper = [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; };
	const auto is_new = [&](const Candidate& candidate)
	{
		const auto [first, last] = std::equal_range(judged.begin(), judged.end(), candidate, is_cheaper);
		const auto is_same = [&](const Candidate& other)
		{ return other.pose == candidate.pose && other.map == candidate.map; };
		return std::none_of(first, last, is_same);
	};
	std::vector<Candidate> left;
	std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(left), is_new);
	return left;
}

/// Makes a localized answer ambiguous.
void doubt(Localization& answer, double needed_confidence)
{
	if (answer.status != Status::kLocalized) return;
	const double share = needed_confidence / answer.confidence;
	for (Hypothesis& hypothesis : answer.hypotheses)
		hypothesis.probability = std::min(share * hypothesis.probability, needed_confidence);
	answer.confidence = answer.best().probability;
	answer.status = Status::kAmbiguous;
}

/// Says in the note of a rejected scan that a region was searched.
void note_region(Localization& answer, const std::vector<SearchedMap>& maps)
{
	const auto is_bounded = [](const SearchedMap& map) { return !map.prior.anywhere(); };
	if (answer.status == Status::kRejected && std::any_of(maps.begin(), maps.end(), is_bounded))
		answer.note = "no place in the given region explains the scan";
}

/// Returns the places, best first, that candidates and the `known` places lead to.
std::vector<Place> judge(
    const Scan& scan, const BeamSubsets& beams, const std::vector<Candidate>& candidates, const Parameters& limits,
    const std::vector<Place>& known, StageClock& clock)
{
	auto settled = settle(beams.few, candidates, limits.refinement);
	clock.lap(&StageTimes::registration_ms);
	// The best place so far competes, so that what is hopeless against it is dropped.
	if (!known.empty()) settled.push_back({known.front(), known.front().score.explained});
	const auto shortlist = make_shortlist(beams.few, settled, limits.refinement);
	const auto refined = refine(beams.many, shortlist, limits.refinement);
	auto places = find_places(scan, beams.all, refined, limits, known);
	clock.lap(&StageTimes::refinement_ms);
	return places;
}

/// Returns a scan whose beams are in the opposite order, as of a laser that is mounted upside down.
Scan mirrored(Scan scan)
{
	for (Beam& beam : scan.beams) beam.angle = beam_angle(-static_cast<double>(beam.angle));
	std::sort(scan.beams.begin(), scan.beams.end(), [](const Beam& a, const Beam& b) { return a.angle < b.angle; });
	return scan;
}

/// Returns whether a look at the mirrored scan may keep an answer from being localized: there is some doubt whether a
/// place of the map is right at all, and beams that the map does not explain.
bool is_worth_mirroring(
    const Scan& scan, const BeamSubset& all, const Verdict& verdict, const std::vector<SearchedMap>& maps)
{
	constexpr double kNoDoubt = 3e-4;  // [probability] that no place is right
	const Localization& answer = verdict.decision.answer;
	if (answer.status != Status::kLocalized || 1 - answer.presence < kNoDoubt) return false;
	const BeamModel& model = verdict.places.front().parameters().scoring.beam_model;
	const Decision at_most = decide(scan, verdict.places, maps, greatest_log_likelihood(all, model));
	return at_most.answer.status != Status::kLocalized;
}

/// Returns the log-likelihood [nat] of the mirrored scan at the place where it fits best; -inf if the overviews show
/// none where it fits about as well as the scan itself.
/// \param limits of a whole look
double log_likelihood_of_mirrored(
    const Scan& scan, const CoarseSearch& search, const std::vector<SearchedMap>& maps, Parameters limits,
    StageClock& clock)
{
	constexpr std::uint32_t kCostlier = 16;  // [2 steps] may overviews show the place, for they are rough
	limits.first_look.effort = kLittleEffort;
	limits = for_first_look(limits);
	const Scan other = mirrored(scan);
	const std::uint32_t most_cost = std::min(search.least_in_overviews() + kCostlier, kAnyOverviewCost - 1);
	const auto found = CoarseSearch(maps, other, limits.coarse_search, most_cost).candidates(limits.coarse_search);
	clock.lap(&StageTimes::retrieval_ms);
	if (found.candidates.empty()) return -HUGE_VAL;
	const auto places = judge(other, BeamSubsets(other), found.candidates, limits, {}, clock);
	return places.empty() ? -HUGE_VAL : places.front().score.log_likelihood;
}
}  // namespace

// The whole method: search candidates, judge them, decide; stop if the answer is clear and safe, and no place equals
// it. Last, see whether the mirrored scan fits better.
Decision localize_default(const Scan& scan, const std::vector<SearchedMap>& maps, double time_budget)
{
	const TimeBudget budget(time_budget);
	const BeamSubsets beams(scan);
	const std::vector<Parameters> looks = first_and_whole_look(limits_of_search(maps));
	const Parameters few = with_share_of_effort(looks.back(), kLittleEffort);
	StageClock clock;
	CoarseSearch search(maps, scan, looks.back().coarse_search);
	Verdict verdict;
	std::vector<Candidate> judged;  // by the look before
	for (const Parameters& look : looks)
	{
		const bool is_last = &look == &looks.back();
		CandidateList found = search.candidates(look.coarse_search);
		clock.lap(&StageTimes::retrieval_ms);
		if (!is_last && !may_be_safe(found, search.margin())) continue;
		const auto trial = [&](const auto& candidates, const Parameters& limits)
		{ judge(scan, beams, candidates, limits, {}, clock); };
		Parameters limits = keep_affordable(budget.left(), look, trial, found);
		if (!judged.empty()) limits = with_share_of_effort(limits, 1 - look.first_look.effort);
		verdict.places = judge(scan, beams, without(judged, found.candidates), limits, verdict.places, clock);
		verdict.decision = decide(scan, verdict.places, maps);
		verdict.is_whole = is_last && found.is_whole;
		verdict.is_safe = is_safe(cost_of(verdict.decision, scan, found.candidates), found, search.margin());
		judged = std::move(found.candidates);
		if (budget.is_half_spent()) break;
		if (!may_stand(verdict, maps, is_last)) continue;
		const auto equals = without(judged, search.equals(verdict.sensor(scan), verdict.decision.maps.front()));
		clock.lap(&StageTimes::retrieval_ms);
		if (!equals.empty()) verdict.places = judge(scan, beams, equals, few, verdict.places, clock);
		verdict.decision = decide(scan, verdict.places, maps);
		if (is_clear(verdict.decision, maps)) break;
	}
	double of_mirrored = -HUGE_VAL;  // [nat]
	if (!budget.is_half_spent() && is_worth_mirroring(scan, beams.all, verdict, maps))
		of_mirrored = log_likelihood_of_mirrored(scan, search, maps, looks.back(), clock);
	add_covariances(beams.all, looks.back().scoring, verdict.places);
	verdict.decision = decide(scan, verdict.places, maps, of_mirrored);
	clock.lap(&StageTimes::refinement_ms);
	Localization& answer = verdict.decision.answer;
	if (!verdict.is_whole && !verdict.is_safe) doubt(answer, needed_confidence(verdict.decision, maps));
	note_region(answer, maps);
	answer.times = clock.times();
	return std::move(verdict.decision);
}

std::optional<Localization> refusal_of(const Scan& scan, const ScanParameters& parameters)
{
	if (!scan.valid()) return no_place(Status::kInvalid, why_invalid(scan));
	if (!is_covered(scan, parameters)) return std::nullopt;
	return no_place(Status::kRejected, "nine of ten beams end within scan.covered_within: the sensor is covered");
}

DefaultLocalizer::DefaultLocalizer(DefaultIndex index, const Parameters& parameters)
    : parameters_(parameters),
      index_(std::move(index)),
      caster_(index_.readings.front().tracer.map(), parameters.paper.max_range)
{
}

Localization DefaultLocalizer::localize(const Scan& scan, const Query& query) const
{
	if (auto refusal = refusal_of(scan, parameters_.scan)) return *refusal;
	return localize_default(scan, {searched(query.prior, 0)}, query.time_budget).answer;
}

std::optional<Hypothesis> DefaultLocalizer::hypothesis_near(const Scan& scan, const mrpt::math::TPose2D& robot) const
{
	if (!scan.valid()) return std::nullopt;
	Parameters lenient = parameters_;
	lenient.scoring.rejected_below = 0;
	const Prior anywhere;
	const std::vector<SearchedMap> maps = {index_.searched(anywhere, lenient)};
	const std::vector<Candidate> candidates = {{robot + scan.sensor_on_robot, 0, &maps.front()}};
	StageClock clock;
	const BeamSubsets beams(scan);
	std::vector<Place> places = judge(scan, beams, candidates, lenient, {}, clock);
	add_covariances(beams.all, lenient.scoring, places);
	const Decision decision = decide(scan, places, maps);
	if (decision.answer.hypotheses.empty()) return std::nullopt;
	Hypothesis hypothesis = decision.answer.best();
	hypothesis.probability = 0;
	return hypothesis;
}
}  // namespace d2s1r
