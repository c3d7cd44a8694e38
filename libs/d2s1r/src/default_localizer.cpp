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
	coarse.overview_missing *= effort;
	for (double* margin : {&coarse.overview_margin, &coarse.margin}) *margin *= margins;
	return first;
}

/// One of the searches that are made, one after the other, until the answer is clear.
struct Look
{
	Parameters parameters;
	bool is_last;

	/// Returns whether there may be candidates that this look leaves out, and a later one would not.
	bool leaves_out(const std::vector<Candidate>& candidates) const
	{
		return !is_last && static_cast<int>(candidates.size()) >= parameters.coarse_search.candidates;
	}
};

std::vector<Look> looks(const Parameters& parameters)
{
	if (parameters.first_look.clear_above >= 1) return {{parameters, true}};
	return {{for_first_look(parameters), false}, {parameters, true}};
}

/// The time that a query may take.
class TimeBudget
{
   public:
	/// \param budget [ms] 0: as much as it takes
	explicit TimeBudget(double budget) : budget_ms_(budget > 0 ? budget : HUGE_VAL) {}

	bool is_half_spent() const { return left_ms() < 0.5 * budget_ms_; }

	/// Judges as many candidates as a share [-] of the time that is left allows.
	template <class Judge>
	std::vector<Place> judge(
	    const Judge& judge, const std::vector<Candidate>& candidates, const Parameters& parameters, double share) const
	{
		const auto affordable = affordable_candidates(share * left_ms(), candidates, parameters, judge);
		return judge(affordable.candidates, affordable.parameters);
	}

   private:
	double left_ms() const { return budget_ms_ - 1e3 * watch_.Tac(); }

	double budget_ms_;
	mrpt::system::CTicTac watch_;
};

/// Returns whether an answer needs no second look.
bool is_clear(const Localization& answer, const FirstLookParameters& parameters)
{
	return answer.status == Status::kLocalized && answer.confidence > parameters.clear_above;
}

/// What a query works with, and the time that its stages take.
struct Work
{
	const Scan& scan;
	const DefaultIndex& index;
	const Prior& prior;
	TimeBudget budget;
	StageTimes times;

	/// Returns the share [-] of the time left that one of the readings not yet searched, `map` the first of them, has.
	double share_of(const MapReading& map) const
	{
		return 1.0 / static_cast<double>(&index.readings.back() - &map + 1);
	}
};

// The whole method: from candidates to places, from a look at all readings to an answer, and one look after the other.
std::vector<Place> places_among(
    const std::vector<Candidate>& candidates, const MapReading& map, const Parameters& parameters, Work& work)
{
	const BeamSubset few = few_beams(work.scan), many = many_beams(work.scan), all = all_beams(work.scan);
	StageTimes& times = work.times;
	const auto settled = timed(times.registration_ms, settle, map.field, few, candidates, parameters.refinement);
	const auto shortlist = timed(times.refinement_ms, make_shortlist, map.tracer, map.field, few, settled, parameters);
	const auto poses = timed(times.refinement_ms, refine, map.field, many, shortlist, parameters.refinement);
	return timed(
	    times.refinement_ms, find_places, map.tracer, map.field, work.scan, all, poses, work.prior, parameters);
}

std::optional<Localization> answer_of(const Look& look, Work& work)
{
	std::vector<Place> places;
	for (const MapReading& map : work.index.readings)
	{
		const auto candidates = timed(
		    work.times.retrieval_ms, coarse_search, map.profiles, work.scan, look.parameters.coarse_search, work.prior);
		if (look.leaves_out(candidates)) return std::nullopt;
		const auto judge = [&](const auto& some, const auto& with) { return places_among(some, map, with, work); };
		const auto found = work.budget.judge(judge, candidates, look.parameters, work.share_of(map));
		places = merged_places(std::move(places), found, look.parameters.scoring);
	}
	return timed(work.times.refinement_ms, decide, work.scan, places, look.parameters);
}
}  // namespace

Localization localize_default(
    const Scan& scan, const DefaultIndex& index, const Parameters& parameters, const Query& query)
{
	Work work{scan, index, query.prior, TimeBudget(query.time_budget), {}};
	std::optional<Localization> answer;
	for (const Look& look : looks(parameters))
	{
		answer = answer_of(look, work);
		if (answer && (is_clear(*answer, parameters.first_look) || work.budget.is_half_spent())) break;
	}
	answer->times = work.times;  // the last look always has an answer
	return *answer;
}

std::optional<Hypothesis> hypothesis_near(
    const Scan& scan, const DefaultIndex& index, const mrpt::math::TPose2D& robot, const Parameters& parameters)
{
	Parameters lenient = parameters;
	lenient.scoring.rejected_below = 0;
	const std::vector<Candidate> here{Candidate{robot + scan.sensor_on_robot}};
	const Prior anywhere;
	Work work{scan, index, anywhere, TimeBudget(0), {}};
	std::vector<Place> places;
	for (const MapReading& map : index.readings)
		places = merged_places(std::move(places), places_among(here, map, lenient, work), lenient.scoring);
	const Localization result = decide(scan, places, lenient);
	if (result.hypotheses.empty()) return std::nullopt;
	Hypothesis hypothesis = result.best();
	hypothesis.probability = 0;
	return hypothesis;
}

namespace
{
bool may_be_smeared(const WallMeasure& walls, const Grid& grid)
{
	return walls.surface_depth > 0.5 * grid.cell_size;
}
}  // namespace

int count_readings(const Grid& grid)
{
	return may_be_smeared(measure_walls(grid), grid) ? 2 : 1;
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
	if (may_be_smeared(walls, grid))
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
