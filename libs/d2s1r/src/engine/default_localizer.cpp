// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "engine/default_localizer.h"

#include <mrpt/system/CTicTac.h>

#include <algorithm>
#include <cmath>
#include <functional>
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

/// [-] Share of the poses for the search for the mirrored scan, which may only cast doubt on an answer: the place that
/// it looks for is among the best ones.
constexpr double kEffortForMirrored = 0.03;

/// [-] Share of the poses for the few places that equal an answer: the best ones are polished and compared.
constexpr double kEffortForEqualPlaces = 0.3;

/// How much a look searches.
enum class Look
{
	kFirst,
	kWhole
};

/// What a look has found.
struct Verdict
{
	std::vector<Place>
	    places;  //!< the likeliest first; that of the answer may be another one, if there are several maps
	Decision decision;
	LeftOut left_out = LeftOut::kAny;

	const Place& of_answer() const { return places[decision.best]; }
};

/// Returns the confidence [probability] that an answer must have to be localized, by the map of its best place.
double needed_confidence(const Decision& decision, const std::vector<SearchedMap>& maps)
{
	const std::size_t best = decision.maps.empty() ? 0 : decision.maps.front();
	return maps[best].parameters.scoring.localized_above;
}

/// Returns whether an answer leaves clearly less doubt than a localized frame may: by a share that was chosen by hand.
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

/// Refines and scores poses of the sensor for one scan.
class Judge
{
   public:
	/// \param stop see Query
	/// \param clock of all that is done for the scan
	Judge(const Scan& scan, const std::function<bool()>& stop, StageClock& clock)
	    : few(few_beams(scan)), many(many_beams(scan)), all(all_beams(scan)), scan_(scan), stop_(stop), clock_(clock)
	{
	}

	/// Returns whether the caller wants no answer any more.
	bool is_stopped() const { return stop_ && stop_(); }

	/// Returns the places, best first, that candidates and the `known` places lead to; none if the search is stopped.
	/// \param least [nat] score by few beams that a candidate must reach, once it has settled
	std::vector<Place> places(
	    const std::vector<Candidate>& candidates, const Parameters& limits, const std::vector<Place>& known = {},
	    double least = -HUGE_VAL) const;

	BeamSubset few, many, all;  //!< of the beams

   private:
	const Scan& scan_;
	const std::function<bool()>& stop_;
	StageClock& clock_;
};

std::vector<Place> Judge::places(
    const std::vector<Candidate>& candidates, const Parameters& limits, const std::vector<Place>& known,
    double least) const
{
	auto settled = settle(few, candidates, limits.refinement);
	clock_.lap(&StageTimes::registration_ms);
	if (is_stopped()) return {};
	// The best place so far competes, so that what is hopeless against it is dropped.
	if (!known.empty()) settled.push_back({known.front(), known.front().score.explained});
	const auto shortlist = make_shortlist(few, settled, limits.refinement, least);
	if (is_stopped()) return {};
	const auto refined = refine(many, shortlist, limits.refinement);
	if (is_stopped()) return {};
	auto found = find_places(scan_, all, refined, limits, known);
	clock_.lap(&StageTimes::refinement_ms);
	return found;
}

/// Returns a scan whose beams are in the opposite order, as of a laser that is mounted upside down.
Scan mirrored(Scan scan)
{
	for (Beam& beam : scan.beams) beam.angle = beam_angle(-static_cast<double>(beam.angle));
	std::sort(scan.beams.begin(), scan.beams.end(), [](const Beam& a, const Beam& b) { return a.angle < b.angle; });
	return scan;
}

/// Searches the maps for one scan, look after look. What it has found so far is its verdict.
class ScanSearch
{
   public:
	ScanSearch(const Scan& scan, const std::vector<SearchedMap>& maps, const Query& query)
	    : scan_(scan),
	      maps_(maps),
	      whole_(limits_of_search(maps)),
	      budget_(query.time_budget),
	      stop_(query.stop),
	      judge_(scan, stop_, clock_),
	      search_(maps, scan, whole_.coarse_search, stop_)
	{
	}

	/// Searches candidates, judges those that no look before has judged, and decides.
	/// \return whether a longer search would hardly change the answer, or there is no time for one
	bool is_settled_by(Look look);

	/// Returns the answer, with covariances.
	Decision answer();

   private:
	bool judge_candidates(Look look);
	bool is_final(Look look);
	void judge_equal_places();
	bool is_worth_mirroring() const;
	double log_likelihood_of_mirrored();

	const Scan& scan_;
	const std::vector<SearchedMap>& maps_;
	Parameters whole_;  //!< limits of the whole search
	TimeBudget budget_;
	const std::function<bool()>& stop_;
	StageClock clock_;
	Judge judge_;
	CoarseSearch search_;
	std::vector<Candidate> judged_;  //!< by the look before
	Verdict verdict_;
};

bool ScanSearch::is_settled_by(Look look)
{
	return judge_candidates(look) && (budget_.is_half_spent() || is_final(look));
}

/// \return false if it judged none: the whole look has to judge them anyway, or the search is stopped
bool ScanSearch::judge_candidates(Look look)
{
	const Parameters limits = look == Look::kFirst ? for_first_look(whole_) : whole_;
	CandidateList found = search_.candidates(limits.coarse_search);
	clock_.lap(&StageTimes::retrieval_ms);
	if (judge_.is_stopped()) return false;
	const auto left_out = [&](double cost) { return left_out_of(found, cost, search_.margin()); };
	const bool may_settle = !found.candidates.empty() && left_out(found.candidates.front().cost) == LeftOut::kCostly;
	if (look == Look::kFirst && !may_settle) return false;
	const auto trial = [&](const auto& candidates, const Parameters& affordable)
	{ judge_.places(candidates, affordable); };
	Parameters affordable = keep_affordable(budget_.left(), limits, trial, found);
	if (!judged_.empty()) affordable = with_share_of_effort(affordable, 1 - limits.first_look.effort);
	const auto candidates = without(judged_, found.candidates);
	verdict_.places = judge_.places(candidates, affordable, verdict_.places);
	verdict_.decision = decide(scan_, verdict_.places, maps_);
	verdict_.left_out = look == Look::kWhole && found.is_whole
	                        ? LeftOut::kNone
	                        : left_out(cost_of(verdict_.decision, scan_, found.candidates));
	judged_ = std::move(found.candidates);
	return true;
}

/// Returns whether the answer is localized and clear, no cheaper candidate was left out, and no place equals its own.
/// It judges those that may.
bool ScanSearch::is_final(Look look)
{
	if (verdict_.decision.answer.status != Status::kLocalized) return false;
	const bool leaves_doubt = verdict_.left_out == LeftOut::kAny || !is_clear(verdict_.decision, maps_);
	if (look == Look::kFirst && leaves_doubt) return false;
	judge_equal_places();
	return is_clear(verdict_.decision, maps_);
}

/// Lets the places that equal that of the answer, cell for cell, compete with it.
void ScanSearch::judge_equal_places()
{
	std::vector<RefinedPose> poses;
	const Place& best = verdict_.of_answer();
	for (const EqualPlace& equal : equal_places(judge_.many, maps_, best.scored_at, best.map->number))
		for (std::size_t reading = 0; reading < equal.map->readings.size(); reading++)
			poses.push_back({{equal.pose, equal.map, reading}});
	clock_.lap(&StageTimes::retrieval_ms);
	if (poses.empty()) return;
	const Parameters limits = with_share_of_effort(whole_, kEffortForEqualPlaces);
	// As they are, they fit as well as the answer does. Refined, they may end at a pose beside that.
	const auto refined = refine(judge_.many, poses, limits.refinement);
	poses.insert(poses.end(), refined.begin(), refined.end());
	verdict_.places = find_places(scan_, judge_.all, poses, limits, verdict_.places);
	verdict_.decision = decide(scan_, verdict_.places, maps_);
	clock_.lap(&StageTimes::refinement_ms);
}

/// Returns whether a look at the mirrored scan may keep the answer from being localized: there is some doubt whether a
/// place of the map is right at all, and beams that the map does not explain.
bool ScanSearch::is_worth_mirroring() const
{
	constexpr double kNoDoubt = 3e-4;  // [probability] that no place is right
	const Localization& answer = verdict_.decision.answer;
	if (answer.status != Status::kLocalized || 1 - answer.presence < kNoDoubt) return false;
	const BeamModel& model = verdict_.places.front().parameters().scoring.beam_model;
	const Decision at_most = decide(scan_, verdict_.places, maps_, greatest_log_likelihood(judge_.all, model));
	return at_most.answer.status != Status::kLocalized;
}

/// Returns the log-likelihood [nat] of the mirrored scan at the place where it fits best; -inf if there is none where
/// it fits about as well as the scan itself by the overviews, and better than at the likeliest place by a few beams.
double ScanSearch::log_likelihood_of_mirrored()
{
	constexpr std::uint32_t kCostlier = 16;  // [2 steps] may overviews show the place, for they are rough
	Parameters limits = whole_;
	limits.first_look.effort = kEffortForMirrored;
	limits = for_first_look(limits);
	const Scan other = mirrored(scan_);
	const std::uint32_t most_cost = std::min(search_.least_in_overviews() + kCostlier, kAnyOverviewCost - 1);
	const auto found =
	    CoarseSearch(maps_, other, limits.coarse_search, stop_, most_cost).candidates(limits.coarse_search);
	clock_.lap(&StageTimes::retrieval_ms);
	if (found.candidates.empty()) return -HUGE_VAL;
	const Place& best = verdict_.places.front();
	const BeamModel& model = best.parameters().scoring.beam_model;
	const double least = score(best.tracer(), best.field(), judge_.few, best.pose, model).log_likelihood;
	const auto places = Judge(other, stop_, clock_).places(found.candidates, limits, {}, least);
	return places.empty() ? -HUGE_VAL : places.front().score.log_likelihood;
}

Decision ScanSearch::answer()
{
	double mirrored_fit = -HUGE_VAL;  // [nat] log-likelihood of the mirrored scan
	if (!budget_.is_half_spent() && is_worth_mirroring()) mirrored_fit = log_likelihood_of_mirrored();
	if (judge_.is_stopped()) return {stopped_search(), {}, 0};
	add_covariances(judge_.all, whole_.scoring, verdict_.places);
	verdict_.decision = decide(scan_, verdict_.places, maps_, mirrored_fit);
	clock_.lap(&StageTimes::refinement_ms);
	Localization& answer = verdict_.decision.answer;
	if (verdict_.left_out == LeftOut::kAny) doubt(answer, needed_confidence(verdict_.decision, maps_));
	note_region(answer, maps_);
	answer.times = clock_.times();
	return std::move(verdict_.decision);
}
}  // namespace

// The whole method: search candidates, judge them, decide; stop if the answer is clear, no cheaper candidate was left
// out, and no place equals it. Last, see whether the mirrored scan fits better.
Decision localize_default(const Scan& scan, const std::vector<SearchedMap>& maps, const Query& query)
{
	ScanSearch search(scan, maps, query);
	const bool has_first_look = maps.front().parameters.first_look.effort < 1;
	if (!has_first_look || !search.is_settled_by(Look::kFirst)) search.is_settled_by(Look::kWhole);
	return search.answer();
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
	return localize_default(scan, {index_.searched(query.prior, parameters)}, query).answer;
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
	const std::function<bool()> never;
	const Judge judge(scan, never, clock);
	std::vector<Place> places = judge.places(candidates, lenient);
	add_covariances(judge.all, lenient.scoring, places);
	Localization answer = decide(scan, places, maps).answer;
	clock.lap(&StageTimes::refinement_ms);
	answer.times = clock.times();
	return answer;
}
}  // namespace d2s1r
