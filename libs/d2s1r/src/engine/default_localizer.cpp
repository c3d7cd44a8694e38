// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "engine/default_localizer.h"

#include <mrpt/system/CTicTac.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "answer/distinct_poses.h"
#include "coarse/equal_places.h"
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

/// [-] Share of the poses for the search for the mirrored scan, which may only cast doubt on an answer: the place that
/// it looks for is among the best ones.
constexpr double kLittleEffort = 0.03;

/// [-] The same for the few places that equal an answer: the best ones are polished and compared.
constexpr double kSomeEffort = 0.3;

/// What a look has found.
struct Verdict
{
	std::vector<Place> places;  //!< best first
	Decision decision;
	bool is_whole = false;  //!< all candidates of the whole search were judged
	bool is_safe = false;   //!< all that were not cost far more than that of the answer

	/// Returns the place of the answer, if there is one.
	const Place& best() const
	{
		const auto is_best = [&](const Place& place) { return place.map->number == decision.maps.front(); };
		return *std::find_if(places.begin(), places.end(), is_best);
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

/// Returns whether the caller wants no answer any more.
bool is_stopped(const SearchedMap& map)
{
	return map.stop && map.stop();
}

/// Returns the places, best first, that candidates and the `known` places lead to; none if the search is stopped.
/// \param least [nat] score by few beams that a candidate must reach, once it has settled
std::vector<Place> judge(
    const Scan& scan, const BeamSubsets& beams, const std::vector<Candidate>& candidates, const Parameters& limits,
    const std::vector<Place>& known, StageClock& clock, double least = -HUGE_VAL)
{
	const auto is_enough = [&] { return !candidates.empty() && is_stopped(*candidates.front().map); };
	auto settled = settle(beams.few, candidates, limits.refinement);
	clock.lap(&StageTimes::registration_ms);
	if (is_enough()) return {};
	// The best place so far competes, so that what is hopeless against it is dropped.
	if (!known.empty()) settled.push_back({known.front(), known.front().score.explained});
	const auto shortlist = make_shortlist(beams.few, settled, limits.refinement, least);
	if (is_enough()) return {};
	const auto refined = refine(beams.many, shortlist, limits.refinement);
	if (is_enough()) return {};
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

/// Localizes one scan, look after look. What it has found so far is its verdict.
class OneScan
{
   public:
	/// \param whole limits of the whole search
	OneScan(const Scan& scan, const std::vector<SearchedMap>& maps, const Parameters& whole, const TimeBudget& budget)
	    : scan_(scan),
	      maps_(maps),
	      whole_(whole),
	      budget_(budget),
	      beams_(scan),
	      search_(maps, scan, whole.coarse_search)
	{
	}

	/// Searches candidates, judges those that no look before has judged, and decides.
	/// \return false if it judged none: the last look has to judge them anyway, or the search is stopped
	bool look(const Parameters& limits, bool is_last);

	/// Returns whether a longer search would hardly change the answer: it is localized, clear and safe, and no place
	/// equals its own. It judges those that may.
	bool may_stand(bool is_last);

	/// Looks whether the mirrored scan fits better, if it can change the answer.
	void look_at_mirrored();

	/// Returns the answer, with covariances.
	Decision answer();

   private:
	void judge_equal_places();
	bool is_worth_mirroring() const;
	double log_likelihood_of_mirrored();

	const Scan& scan_;
	const std::vector<SearchedMap>& maps_;
	const Parameters& whole_;
	const TimeBudget& budget_;
	BeamSubsets beams_;
	StageClock clock_;
	CoarseSearch search_;
	std::vector<Candidate> judged_;  //!< by the look before
	Verdict verdict_;
	double mirrored_ = -HUGE_VAL;  //!< [nat] log-likelihood of the mirrored scan where it fits best
};

bool OneScan::look(const Parameters& limits, bool is_last)
{
	CandidateList found = search_.candidates(limits.coarse_search);
	clock_.lap(&StageTimes::retrieval_ms);
	if (is_stopped(maps_.front())) return false;
	if (!is_last && !may_be_safe(found, search_.margin())) return false;
	const auto trial = [&](const auto& candidates, const Parameters& affordable)
	{ judge(scan_, beams_, candidates, affordable, {}, clock_); };
	Parameters affordable = keep_affordable(budget_.left(), limits, trial, found);
	if (!judged_.empty()) affordable = with_share_of_effort(affordable, 1 - limits.first_look.effort);
	const auto candidates = without(judged_, found.candidates);
	verdict_.places = judge(scan_, beams_, candidates, affordable, verdict_.places, clock_);
	verdict_.decision = decide(scan_, verdict_.places, maps_);
	verdict_.is_whole = is_last && found.is_whole;
	verdict_.is_safe = is_safe(cost_of(verdict_.decision, scan_, found.candidates), found, search_.margin());
	judged_ = std::move(found.candidates);
	return true;
}

bool OneScan::may_stand(bool is_last)
{
	if (verdict_.decision.answer.status != Status::kLocalized) return false;
	if (!is_last && !(verdict_.is_safe && is_clear(verdict_.decision, maps_))) return false;
	judge_equal_places();
	return is_clear(verdict_.decision, maps_);
}

/// Lets the places that equal that of the answer, cell for cell, compete with it.
void OneScan::judge_equal_places()
{
	std::vector<RefinedPose> poses;
	const Place& best = verdict_.best();
	for (const EqualPlace& equal : equal_places(beams_.many, maps_, best.scored_at, best.map->number))
		for (std::size_t reading = 0; reading < equal.map->readings.size(); reading++)
			poses.push_back({{equal.pose, equal.map, reading}});
	clock_.lap(&StageTimes::retrieval_ms);
	if (poses.empty()) return;
	const Parameters limits = with_share_of_effort(whole_, kSomeEffort);
	// As they are, they fit as well as the answer does. Refined, they may end at a pose beside that.
	const auto refined = refine(beams_.many, poses, limits.refinement);
	poses.insert(poses.end(), refined.begin(), refined.end());
	verdict_.places = find_places(scan_, beams_.all, poses, limits, verdict_.places);
	verdict_.decision = decide(scan_, verdict_.places, maps_);
	clock_.lap(&StageTimes::refinement_ms);
}

void OneScan::look_at_mirrored()
{
	if (is_worth_mirroring()) mirrored_ = log_likelihood_of_mirrored();
}

/// Returns whether a look at the mirrored scan may keep the answer from being localized: there is some doubt whether a
/// place of the map is right at all, and beams that the map does not explain.
bool OneScan::is_worth_mirroring() const
{
	constexpr double kNoDoubt = 3e-4;  // [probability] that no place is right
	const Localization& answer = verdict_.decision.answer;
	if (answer.status != Status::kLocalized || 1 - answer.presence < kNoDoubt) return false;
	const BeamModel& model = verdict_.places.front().parameters().scoring.beam_model;
	const Decision at_most = decide(scan_, verdict_.places, maps_, greatest_log_likelihood(beams_.all, model));
	return at_most.answer.status != Status::kLocalized;
}

/// Returns the log-likelihood [nat] of the mirrored scan at the place where it fits best; -inf if there is none where
/// it fits about as well as the scan itself by the overviews, and better by a few beams.
double OneScan::log_likelihood_of_mirrored()
{
	constexpr std::uint32_t kCostlier = 16;  // [2 steps] may overviews show the place, for they are rough
	Parameters limits = whole_;
	limits.first_look.effort = kLittleEffort;
	limits = for_first_look(limits);
	const Scan other = mirrored(scan_);
	const std::uint32_t most_cost = std::min(search_.least_in_overviews() + kCostlier, kAnyOverviewCost - 1);
	const auto found = CoarseSearch(maps_, other, limits.coarse_search, most_cost).candidates(limits.coarse_search);
	clock_.lap(&StageTimes::retrieval_ms);
	if (found.candidates.empty()) return -HUGE_VAL;
	const Place& best = verdict_.places.front();
	const BeamModel& model = best.parameters().scoring.beam_model;
	const double least = score(best.tracer(), best.field(), beams_.few, best.pose, model).log_likelihood;
	const auto places = judge(other, BeamSubsets(other), found.candidates, limits, {}, clock_, least);
	return places.empty() ? -HUGE_VAL : places.front().score.log_likelihood;
}

Decision OneScan::answer()
{
	add_covariances(beams_.all, whole_.scoring, verdict_.places);
	verdict_.decision = decide(scan_, verdict_.places, maps_, mirrored_);
	clock_.lap(&StageTimes::refinement_ms);
	Localization& answer = verdict_.decision.answer;
	if (!verdict_.is_whole && !verdict_.is_safe) doubt(answer, needed_confidence(verdict_.decision, maps_));
	note_region(answer, maps_);
	answer.times = clock_.times();
	return std::move(verdict_.decision);
}
}  // namespace

// The whole method: search candidates, judge them, decide; stop if the answer is clear and safe, and no place equals
// it. Last, see whether the mirrored scan fits better.
Decision localize_default(const Scan& scan, const std::vector<SearchedMap>& maps, double time_budget)
{
	const TimeBudget budget(time_budget);
	const std::vector<Parameters> looks = first_and_whole_look(limits_of_search(maps));
	OneScan search(scan, maps, looks.back(), budget);
	for (const Parameters& limits : looks)
	{
		const bool is_last = &limits == &looks.back();
		if (!search.look(limits, is_last)) continue;
		if (budget.is_half_spent() || search.may_stand(is_last)) break;
	}
	if (!budget.is_half_spent()) search.look_at_mirrored();
	return is_stopped(maps.front()) ? Decision{stopped_search(), {}} : search.answer();
}

std::optional<Localization> refusal_of(const Scan& scan, const ScanParameters& parameters)
{
	if (!scan.valid()) return no_place(Status::kInvalid, why_invalid(scan));
	if (!is_covered(scan, parameters)) return std::nullopt;
	return no_place(Status::kRejected, "nine of ten beams end within scan.covered_within: the sensor is covered");
}

DefaultLocalizer::DefaultLocalizer(DefaultIndex index, const Parameters& parameters)
    : index_(std::move(index)), caster_(index_.readings.front().tracer.map(), parameters.paper.max_range)
{
}

Localization DefaultLocalizer::localize(const Scan& scan, const Query& query, const Parameters& parameters) const
{
	if (auto refusal = refusal_of(scan, parameters.scan)) return *refusal;
	return localize_default(scan, {index_.searched(query.prior, parameters, 0, query.stop)}, query.time_budget).answer;
}

Localization DefaultLocalizer::look_at(
    const Scan& scan, const std::vector<mrpt::math::TPose2D>& robots, const Prior& prior,
    const Parameters& parameters) const
{
	if (!scan.valid()) return no_place(Status::kInvalid, why_invalid(scan));
	Parameters lenient = parameters;
	lenient.scoring.rejected_below = 0;
	const std::vector<SearchedMap> maps = {index_.searched(prior, lenient)};
	std::vector<Candidate> candidates;
	for (const mrpt::math::TPose2D& robot : robots)
		candidates.push_back({robot + scan.sensor_on_robot, 0, &maps.front()});
	StageClock clock;
	const BeamSubsets beams(scan);
	std::vector<Place> places = judge(scan, beams, candidates, lenient, {}, clock);
	add_covariances(beams.all, lenient.scoring, places);
	Localization answer = decide(scan, places, maps).answer;
	clock.lap(&StageTimes::refinement_ms);
	answer.times = clock.times();
	return answer;
}
}  // namespace d2s1r
