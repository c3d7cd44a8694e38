// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "default_localizer.h"

#include <algorithm>
#include <cmath>

#include "base/scoped_timer.h"
#include "fine/decision.h"
#include "fine/shortlist.h"

namespace d2s1r
{
namespace
{
/// The same parameters for a share [-] of the effort of refinement and scoring, rounded up.
Parameters with_share_of_effort(Parameters parameters, double share)
{
	auto& refinement = parameters.refinement;
	for (int* count :
	     {&refinement.max_scored, &refinement.max_refined, &refinement.max_restarted, &refinement.max_polished,
	      &refinement.max_compared})
		*count = static_cast<int>(std::ceil(share * *count));
	return parameters;
}

/// The parameters of the smaller search that comes first.
Parameters for_first_look(const Parameters& parameters)
{
	const double effort = parameters.first_look.effort, margins = parameters.first_look.margins;
	Parameters first = with_share_of_effort(parameters, effort);
	auto& coarse = first.coarse_search;
	for (int* count : {&coarse.max_pairs, &coarse.candidates}) *count = static_cast<int>(std::ceil(effort * *count));
	coarse.overview_unmatched *= effort;
	for (double* margin : {&coarse.overview_margin, &coarse.margin}) *margin *= margins;
	return first;
}

/// The searches that are made, one after the other, until the answer is clear.
std::vector<Parameters> looks(const Parameters& parameters)
{
	if (parameters.first_look.clear_above >= 1) return {parameters};
	return {for_first_look(parameters), parameters};
}

bool is_clear(const Localization& answer, const FirstLookParameters& parameters)
{
	return answer.status == Status::kLocalized && answer.confidence > parameters.clear_above;
}

/// Goes from candidates to an answer: each result feeds the next step.
Localization judge(
    const DefaultIndex& index, const Scan& scan, const std::vector<Candidate>& candidates, const Prior& prior,
    const Parameters& parameters, StageTimes& times)
{
	const DistanceField& field = index.field;
	const BeamTracer& tracer = index.tracer;
	const BeamSubset few = few_beams(scan), many = many_beams(scan), all = all_beams(scan);
	const auto settled = timed(times.registration_ms, settle, field, few, candidates, parameters.refinement);
	const auto shortlist = timed(times.refinement_ms, make_shortlist, tracer, field, few, settled, parameters);
	const auto refined = timed(times.refinement_ms, refine, field, many, shortlist, parameters.refinement);
	const auto places = timed(times.refinement_ms, find_places, tracer, field, scan, all, refined, prior, parameters);
	return timed(times.refinement_ms, decide, field, scan, all, places, parameters);
}
}  // namespace

Localization localize_default(
    const Scan& scan, const DefaultIndex& index, const Parameters& parameters, const Query& query)
{
	constexpr double kShareOfFirstLook = 0.5;  // [-] of the time budget; after it no second look is begun
	const mrpt::system::CTicTac watch;
	const auto spent_ms = [&] { return 1e3 * watch.Tac(); };
	StageTimes times;
	Localization result;
	const std::vector<Parameters> all_looks = looks(parameters);
	for (const Parameters& look : all_looks)
	{
		auto candidates =
		    timed(times.retrieval_ms, coarse_search, index.profiles, scan, look.coarse_search, query.prior);
		const bool some_left_out = static_cast<int>(candidates.size()) >= look.coarse_search.candidates;
		if (some_left_out && &look != &all_looks.back()) continue;
		StageTimes of_sample;
		const AffordableCandidates affordable = affordable_candidates(
		    query.time_budget > 0 ? query.time_budget - spent_ms() : INFINITY, std::move(candidates), look,
		    [&](const auto& some, const Parameters& fewer)
		    { judge(index, scan, some, query.prior, fewer, of_sample); });
		result = judge(index, scan, affordable.candidates, query.prior, affordable.parameters, times);
		const bool is_late = query.time_budget > 0 && spent_ms() > kShareOfFirstLook * query.time_budget;
		if (is_clear(result, parameters.first_look) || is_late) break;
	}
	if (result.status == Status::kRejected && !query.prior.anywhere())
		result.note = "no place in the given region explains the scan";
	result.times = times;
	return result;
}

std::optional<Hypothesis> hypothesis_near(
    const Scan& scan, const DefaultIndex& index, const mrpt::math::TPose2D& robot, const Parameters& parameters)
{
	Parameters lenient = parameters;
	lenient.scoring.rejected_below = 0;
	StageTimes times;
	const Localization result = judge(index, scan, {Candidate{robot + scan.sensor_on_robot}}, {}, lenient, times);
	if (result.hypotheses.empty()) return std::nullopt;
	Hypothesis hypothesis = result.best();
	hypothesis.probability = 0;
	return hypothesis;
}

DefaultIndex make_default_index(const Grid& grid, const std::vector<CellIndex>& cells, const Parameters& parameters)
{
	const Grid hollow = with_hollow_walls(grid);
	return {make_range_profiles(grid, cells, parameters.coarse_search), DistanceField(hollow), BeamTracer(hollow)};
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
