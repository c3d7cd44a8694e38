// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "default_localizer.h"

#include <algorithm>
#include <cmath>

#include "base/scoped_timer.h"
#include "fine/decision.h"
#include "fine/refinement.h"
#include "map/free_cells.h"
#include "ranges/wall_surface.h"

namespace d2s1r
{
namespace
{
/// Returns the same parameters for a share [-] of the effort of refinement and scoring, rounded up.
Parameters with_share_of_effort(Parameters parameters, double share)
{
	auto& refinement = parameters.refinement;
	for (int* count :
	     {&refinement.max_scored, &refinement.max_refined, &refinement.max_restarted, &refinement.max_polished,
	      &refinement.max_compared})
		*count = static_cast<int>(std::ceil(share * *count));
	return parameters;
}

/// Returns the parameters of the smaller search that comes first.
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

/// Returns the parameters of the searches that are made, one after the other, until the answer is clear.
std::vector<Parameters> looks(const Parameters& parameters)
{
	if (parameters.first_look.clear_above >= 1) return {parameters};
	return {for_first_look(parameters), parameters};
}

/// Returns whether an answer needs no second look.
bool is_clear(const Localization& answer, const FirstLookParameters& parameters)
{
	return answer.status == Status::kLocalized && answer.confidence > parameters.clear_above;
}

/// Goes from candidates to places: each result feeds the next step.
std::vector<Place> places_among(
    const std::vector<Candidate>& candidates, const MapReading& map, const Scan& scan, const Prior& prior,
    const Parameters& parameters, StageTimes& times)
{
	const DistanceField& field = map.field;
	const BeamTracer& tracer = map.tracer;
	const BeamSubset few = few_beams(scan), many = many_beams(scan), all = all_beams(scan);
	const auto settled = timed(times.registration_ms, settle, field, few, candidates, parameters.refinement);
	const auto shortlist = timed(times.refinement_ms, make_shortlist, tracer, field, few, settled, parameters);
	const auto refined = timed(times.refinement_ms, refine, field, many, shortlist, parameters.refinement);
	return timed(times.refinement_ms, find_places, tracer, field, scan, all, refined, prior, parameters);
}

/// Searches the map with the effort that `look` allows. The search goes on with as many candidates as the time affords.
/// \return no value if `look` must leave out candidates, and `may_leave_out` is false
std::optional<Localization> answer_of(
    const Parameters& look, bool may_leave_out, const Scan& scan, const DefaultIndex& index, const Query& query,
    const std::function<double()>& left_ms, StageTimes& times)
{
	std::vector<Place> places;
	double share = 1 / static_cast<double>(index.readings.size());  // [-] of the time that is left
	for (const MapReading& map : index.readings)
	{
		auto candidates = timed(times.retrieval_ms, coarse_search, map.profiles, scan, look.coarse_search, query.prior);
		if (!may_leave_out && static_cast<int>(candidates.size()) >= look.coarse_search.candidates) return std::nullopt;
		StageTimes of_sample;
		const AffordableCandidates affordable = affordable_candidates(
		    share * left_ms(), std::move(candidates), look,
		    [&](const auto& some, const Parameters& fewer)
		    { places_among(some, map, scan, query.prior, fewer, of_sample); });
		places = merged_places(
		    std::move(places),
		    places_among(affordable.candidates, map, scan, query.prior, affordable.parameters, times), look.scoring);
		share = 1;
	}
	return timed(times.refinement_ms, decide, scan, places, look);
}
}  // namespace

Localization localize_default(
    const Scan& scan, const DefaultIndex& index, const Parameters& parameters, const Query& query)
{
	constexpr double kShareOfFirstLook = 0.5;  // [-] of the time budget; after it no second look is begun
	const mrpt::system::CTicTac watch;
	const double budget_ms = query.time_budget > 0 ? query.time_budget : HUGE_VAL;
	const auto left_ms = [&] { return budget_ms - 1e3 * watch.Tac(); };
	StageTimes times;
	Localization result;
	const std::vector<Parameters> all_looks = looks(parameters);
	for (const Parameters& look : all_looks)
	{
		const auto answer = answer_of(look, &look == &all_looks.back(), scan, index, query, left_ms, times);
		if (!answer) continue;
		result = *answer;
		if (is_clear(result, parameters.first_look) || left_ms() < (1 - kShareOfFirstLook) * budget_ms) break;
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
	std::vector<Place> places;
	for (const MapReading& map : index.readings)
		places = merged_places(
		    std::move(places), places_among({Candidate{robot + scan.sensor_on_robot}}, map, scan, {}, lenient, times),
		    lenient.scoring);
	const Localization result = decide(scan, places, lenient);
	if (result.hypotheses.empty()) return std::nullopt;
	Hypothesis hypothesis = result.best();
	hypothesis.probability = 0;
	return hypothesis;
}

DefaultIndex make_default_index(const Grid& grid, const Parameters& parameters)
{
	DefaultIndex index;
	const auto add_reading = [&](const Grid& read, double tolerance)
	{
		FreeCellParameters free_cells = parameters.free_cells;
		free_cells.clearance = std::max(free_cells.clearance, parameters.coarse_search.clearance);
		const Grid surfaces = with_wall_surfaces_only(read);
		index.readings.push_back(
		    {make_range_profiles(read, find_sensor_cells(read, free_cells), parameters.coarse_search),
		     DistanceField(surfaces, tolerance), BeamTracer(surfaces)});
	};
	add_reading(grid, 0);
	const WallMeasure walls = measure_walls(grid);
	if (walls.surface_depth > 0.5 * grid.cell_size)
		add_reading(with_surfaces_deeper(grid, walls.surface_depth), walls.surface_tolerance());
	return index;
}

void save(const DefaultIndex& index, IndexWriter& file)
{
	file(index.readings.size());
	for (const MapReading& reading : index.readings) MapReading::fields(reading, file);
}

DefaultIndex read_default_index(IndexReader& file)
{
	std::size_t readings = 0;
	file(readings);
	DefaultIndex index;
	for (std::size_t i = 0; i < readings; i++)
	{
		index.readings.emplace_back();
		MapReading::fields(index.readings.back(), file);
	}
	return index;
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
