// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "default_localizer.h"

#include <mrpt/system/CTicTac.h>

#include <cmath>

#include "hypotheses.h"
#include "paper_localizer.h"
#include "time_budget.h"

namespace d2s1r
{
namespace
{
constexpr double kShareOfFirstLook = 0.5;  //!< [-] of the time budget: after it no second look is begun

/// From candidates to an answer.
Localization judge(
    const DefaultIndex& index, const Scan& scan, const std::vector<Candidate>& candidates, const Prior& prior,
    const Parameters& parameters)
{
	const auto& [profiles, field, tracer] = index;
	mrpt::system::CTicTac watch;
	const Rays few = few_rays(scan), more = many_rays(scan);
	const auto settled = settle(field, few, candidates, parameters.refinement);
	const double registration_ms = 1e3 * watch.Tac();
	watch.Tic();
	const auto promising = choose_promising(tracer, field, few, settled, parameters);
	const auto poses = refine(field, more, promising, parameters.refinement);
	Localization result = decide(tracer, field, scan, all_rays(scan), poses, prior, parameters);
	result.times.registration_ms = registration_ms;
	result.times.refinement_ms = 1e3 * watch.Tac();
	return result;
}

/// After a first look that left out candidates: there may be a better one among them.
Localization not_judged(double retrieval_ms)
{
	Localization result;
	result.times.retrieval_ms = retrieval_ms;
	return result;
}

/// The parameters of the smaller search that comes first.
Parameters for_first_look(const Parameters& parameters)
{
	const auto& [enough, effort, margins] = parameters.first_look;
	Parameters first = with_share_of_effort(parameters, effort);
	auto& coarse = first.coarse_search;
	for (int* count : {&coarse.max_pairs, &coarse.candidates}) *count = static_cast<int>(std::ceil(effort * *count));
	for (double* margin : {&coarse.overview_margin, &coarse.margin}) *margin *= margins;
	return first;
}
}  // namespace

DefaultIndex make_default_index(const Grid& grid, const std::vector<CellIndex>& cells, const Parameters& parameters)
{
	const Grid hollow = with_hollow_walls(grid);
	return {make_range_profiles(grid, cells, parameters.coarse_search), DistanceField(hollow), BeamTracer(hollow)};
}

Localization localize_default(
    const Scan& scan, const DefaultIndex& index, const RayCaster& caster, const Parameters& parameters,
    const Query& query)
{
	const mrpt::system::CTicTac watch;
	bool is_first = parameters.first_look.enough < 1, is_complete = true;
	const auto search = [&](Parameters effort)
	{
		mrpt::system::CTicTac stage;
		auto candidates = coarse_search(index.profiles, scan, effort.coarse_search, query.prior);
		const double retrieval_ms = 1e3 * stage.Tac();
		is_complete = static_cast<int>(candidates.size()) < effort.coarse_search.candidates;
		if (is_first && !is_complete && query.time_budget == 0) return not_judged(retrieval_ms);
		if (query.time_budget > 0)
			effort = keep_affordable(
			    query.time_budget - 1e3 * watch.Tac(), candidates, effort,
			    [&](const auto& some, const Parameters& fewer) { judge(index, scan, some, query.prior, fewer); });
		Localization found = judge(index, scan, candidates, query.prior, effort);
		found.times.retrieval_ms = retrieval_ms;
		return found;
	};
	Localization result = search(is_first ? for_first_look(parameters) : parameters);
	const bool is_clear =
	    is_complete && result.status == Status::kLocalized && result.confidence > parameters.first_look.enough;
	const bool is_late = query.time_budget > 0 && 1e3 * watch.Tac() > kShareOfFirstLook * query.time_budget;
	if (is_first && !is_clear && !is_late)
	{
		const StageTimes first = result.times;
		is_first = false;
		result = search(parameters);
		result.times.retrieval_ms += first.retrieval_ms;
		result.times.registration_ms += first.registration_ms;
		result.times.refinement_ms += first.refinement_ms;
	}
	if (result.status == Status::kRejected && !query.prior.anywhere())
		result.note = "no place in the given region explains the scan";
	if (!result.hypotheses.empty())
		result.relative_entropy =
		    relative_entropy_at(result.best().pose.asTPose() + scan.sensor_on_robot, scan, caster, parameters.paper);
	result.times.total_ms = 1e3 * watch.Tac();
	return result;
}

std::optional<Hypothesis> hypothesis_near(
    const Scan& scan, const DefaultIndex& index, const mrpt::math::TPose2D& robot, const Parameters& parameters)
{
	Parameters lenient = parameters;
	lenient.scoring.rejected_below = 0;
	const Localization result = judge(index, scan, {Candidate{robot + scan.sensor_on_robot}}, {}, lenient);
	if (result.hypotheses.empty()) return std::nullopt;
	Hypothesis hypothesis = result.best();
	hypothesis.probability = 0;
	return hypothesis;
}
}  // namespace d2s1r
