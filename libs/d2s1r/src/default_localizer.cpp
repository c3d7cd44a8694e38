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

/// The parameters of the smaller search that comes first.
Parameters for_first_look(const Parameters& parameters)
{
	const auto& [clear_above, effort, margins] = parameters.first_look;
	Parameters first = with_share_of_effort(parameters, effort);
	auto& coarse = first.coarse_search;
	for (int* count : {&coarse.max_pairs, &coarse.candidates}) *count = static_cast<int>(std::ceil(effort * *count));
	coarse.overview_unmatched *= effort;
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
	const auto spent = [&] { return 1e3 * watch.Tac(); };  // [ms]
	StageTimes times;                                      // of both looks
	const auto retrieve = [&](const CoarseSearchParameters& coarse)
	{
		const double before = spent();
		auto candidates = coarse_search(index.profiles, scan, coarse, query.prior);
		times.retrieval_ms += spent() - before;
		return candidates;
	};
	const auto choose_among = [&](std::vector<Candidate> candidates, Parameters effort)
	{
		if (query.time_budget > 0)
			effort = keep_affordable(
			    query.time_budget - spent(), candidates, effort,
			    [&](const auto& some, const Parameters& fewer) { judge(index, scan, some, query.prior, fewer); });
		Localization chosen = judge(index, scan, candidates, query.prior, effort);
		times.registration_ms += chosen.times.registration_ms;
		times.refinement_ms += chosen.times.refinement_ms;
		return chosen;
	};
	Localization result;
	bool is_enough = false;
	if (parameters.first_look.clear_above < 1)
	{
		const Parameters first = for_first_look(parameters);
		const auto candidates = retrieve(first.coarse_search);
		if (static_cast<int>(candidates.size()) < first.coarse_search.candidates)  // none was left out
		{
			result = choose_among(candidates, first);
			const bool is_clear =
			    result.status == Status::kLocalized && result.confidence > parameters.first_look.clear_above;
			is_enough = is_clear || (query.time_budget > 0 && spent() > kShareOfFirstLook * query.time_budget);
		}
	}
	if (!is_enough) result = choose_among(retrieve(parameters.coarse_search), parameters);
	if (result.status == Status::kRejected && !query.prior.anywhere())
		result.note = "no place in the given region explains the scan";
	if (!result.hypotheses.empty())
		result.relative_entropy =
		    relative_entropy_at(result.best().pose.asTPose() + scan.sensor_on_robot, scan, caster, parameters.paper);
	times.total_ms = spent();
	result.times = times;
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
