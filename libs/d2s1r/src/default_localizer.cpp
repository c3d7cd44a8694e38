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
	auto candidates = coarse_search(index.profiles, scan, parameters.coarse_search, query.prior);
	const double retrieval_ms = 1e3 * watch.Tac();
	Parameters affordable = parameters;
	if (query.time_budget > 0)
		affordable = keep_affordable(
		    query.time_budget - retrieval_ms, candidates, parameters,
		    [&](const auto& some, const Parameters& fewer) { judge(index, scan, some, query.prior, fewer); });
	Localization result = judge(index, scan, candidates, query.prior, affordable);
	if (result.status == Status::kRejected && !query.prior.anywhere())
		result.note = "no place in the given region explains the scan";
	if (!result.hypotheses.empty())
		result.relative_entropy =
		    relative_entropy_at(result.best().pose.asTPose() + scan.sensor_on_robot, scan, caster, parameters.paper);
	result.times.retrieval_ms = retrieval_ms;
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
