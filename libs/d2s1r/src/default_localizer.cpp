// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "default_localizer.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/scoped_timer.h"
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

/// What the coarse search finds in a reading of a map.
struct FoundInReading
{
	std::size_t map;  //!< [-] number of the map
	const MapReading* reading;
	std::vector<Candidate> candidates;  //!< best first
};

/// One of the searches that are made, one after the other, until the answer is clear.
struct Look
{
	std::vector<Parameters> parameters;  //!< by map
	bool is_last;

	/// Returns whether there may be candidates that this look leaves out, and a later one would not.
	bool leaves_out(const std::vector<FoundInReading>& found) const
	{
		const auto is_full = [this](const FoundInReading& in)
		{ return static_cast<int>(in.candidates.size()) >= parameters[in.map].coarse_search.candidates; };
		return !is_last && std::any_of(found.begin(), found.end(), is_full);
	}
};

/// Returns the looks, the last of which is with the parameters as they are. There is only one if any map wants it so.
std::vector<Look> looks(const std::vector<SearchedMap>& maps)
{
	Look first{{}, false}, last{{}, true};
	bool only_one = false;
	for (const SearchedMap& map : maps)
	{
		first.parameters.push_back(for_first_look(map.parameters));
		last.parameters.push_back(map.parameters);
		only_one = only_one || map.parameters.first_look.clear_above >= 1;
	}
	if (only_one) return {std::move(last)};
	return {std::move(first), std::move(last)};
}

/// The time that a query may take.
class TimeBudget
{
   public:
	/// \param budget [ms] 0: as much as it takes
	explicit TimeBudget(double budget) : budget_ms_(budget > 0 ? budget : HUGE_VAL) {}

	double left_ms() const { return budget_ms_ - 1e3 * watch_.Tac(); }
	bool is_half_spent() const { return left_ms() < 0.5 * budget_ms_; }

   private:
	double budget_ms_;
	mrpt::system::CTicTac watch_;
};

/// Returns whether an answer needs no second look.
bool is_clear(const Localization& answer, const FirstLookParameters& parameters)
{
	return answer.status == Status::kLocalized && answer.confidence > parameters.clear_above;
}

std::vector<const Parameters*> parameters_of(const std::vector<SearchedMap>& maps)
{
	std::vector<const Parameters*> parameters;
	for (const SearchedMap& map : maps) parameters.push_back(&map.parameters);
	return parameters;
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

/// Drops the candidates that cost more than the best one in another map by as much as none may in one map.
void drop_costly(std::vector<FoundInReading>& found, const Look& look, const Scan& scan)
{
	for (FoundInReading& here : found)
	{
		double least = HUGE_VAL;  // [step] in other maps
		for (const FoundInReading& there : found)
			if (there.map != here.map && !there.candidates.empty())
				least = std::min(least, there.candidates.front().cost);
		const auto& parameters = look.parameters[here.map].coarse_search;
		const double directions = parameters.directions * scan.field_of_view / (2 * M_PI);
		const double beams = std::min(directions, static_cast<double>(scan.beams.size()));
		const double most = least + parameters.margin / std::sqrt(beams);
		const auto kept = std::find_if(
		    here.candidates.begin(), here.candidates.end(),
		    [=](const Candidate& candidate) { return candidate.cost > most; });
		here.candidates.erase(kept, here.candidates.end());
	}
}

/// Searches all readings of all maps.
std::vector<FoundInReading> candidates_of(const Look& look, const Scan& scan, const std::vector<SearchedMap>& maps)
{
	std::vector<FoundInReading> found;
	for (std::size_t map = 0; map < maps.size(); map++)
		for (const MapReading& reading : maps[map].index.readings)
			found.push_back(
			    {map, &reading,
			     coarse_search(reading.profiles, scan, look.parameters[map].coarse_search, maps[map].prior)});
	drop_costly(found, look, scan);
	return found;
}

/// Goes from candidates to places in all maps.
std::vector<Place> places_in_maps(
    const std::vector<FoundInReading>& found, const Look& look, const Scan& scan, const std::vector<SearchedMap>& maps,
    const TimeBudget& budget, StageTimes& times)
{
	std::vector<std::vector<Place>> by_map(maps.size());
	auto readings = static_cast<double>(found.size());  // [-] that are still to be judged
	for (const auto& [map, reading, candidates] : found)
	{
		const Prior& prior = maps[map].prior;
		const auto judge = [&, &in = *reading](const std::vector<Candidate>& some, const Parameters& parameters)
		{ return places_among(some, in, scan, prior, parameters, times); };
		const auto affordable =
		    affordable_candidates(budget.left_ms() / readings--, candidates, look.parameters[map], judge);
		by_map[map] = merged_places(
		    std::move(by_map[map]), judge(affordable.candidates, affordable.parameters), look.parameters[map].scoring);
	}
	return places_of_all_maps(std::move(by_map), parameters_of(maps));
}

constexpr std::size_t kMostSearched = 8;  //!< [-] maps of an atlas that are searched as a single one is

/// Returns how well the best of the candidates in a map explains the scan [nat], by few beams; higher is better.
double promise_of(const std::vector<Candidate>& candidates, const SearchedMap& map, const BeamSubset& few)
{
	const auto& [profiles, field, tracer] = map.index.readings.front();
	double best = -HUGE_VAL;
	for (const RefinedPose& settled : settle(field, few, candidates, map.parameters.refinement))
		best =
		    std::max(best, score(tracer, field, few, settled.pose, map.parameters.scoring.beam_model).log_likelihood);
	return best;
}

/// Returns the maps that are worth a search: those in which few beams explain the scan best, at a candidate that one
/// search through all maps, as if they were one, finds. They keep their order.
std::vector<std::size_t> promising_maps(const Scan& scan, const std::vector<SearchedMap>& maps)
{
	constexpr int kTimes = 2;  // [-] times as many pairs and candidates for all maps as the first look has for one
	std::vector<std::size_t> numbers(maps.size());
	std::iota(numbers.begin(), numbers.end(), std::size_t{0});
	if (maps.size() <= kMostSearched) return numbers;
	std::vector<CoarseSearchParameters> parameters;
	for (const SearchedMap& map : maps) parameters.push_back(for_first_look(map.parameters).coarse_search);
	parameters.front().max_pairs *= kTimes;
	parameters.front().candidates *= kTimes;
	std::vector<CoarseSearchIn> in;
	for (std::size_t map = 0; map < maps.size(); map++)
		in.push_back({maps[map].index.readings.front().profiles, parameters[map], maps[map].prior});
	const auto candidates = coarse_search(in, scan);
	const BeamSubset few = few_beams(scan);
	std::vector<double> promise;
	for (std::size_t map = 0; map < maps.size(); map++)
		promise.push_back(candidates[map].empty() ? -HUGE_VAL : promise_of(candidates[map], maps[map], few));
	std::stable_sort(
	    numbers.begin(), numbers.end(), [&](std::size_t a, std::size_t b) { return promise[a] > promise[b]; });
	numbers.resize(kMostSearched);
	std::sort(numbers.begin(), numbers.end());
	return numbers;
}

/// Says what the places tell.
Decision conclude(const Scan& scan, const std::vector<SearchedMap>& maps, const std::vector<Place>& places)
{
	Decision result = decide(scan, places, parameters_of(maps));
	const auto is_bounded = [](const SearchedMap& map) { return !map.prior.anywhere(); };
	if (result.answer.status == Status::kRejected && std::any_of(maps.begin(), maps.end(), is_bounded))
		result.answer.note = "no place in the given region explains the scan";
	return result;
}
}  // namespace

Decision localize_default(const Scan& scan, const std::vector<SearchedMap>& all_maps, double time_budget)
{
	const Parameters& parameters = all_maps.front().parameters;
	if (is_covered(scan, parameters.scan))
		return {
		    no_place(Status::kRejected, "nine of ten beams end within scan.covered_within: the sensor is covered"), {}};
	const TimeBudget budget(time_budget);
	StageTimes times;
	const auto numbers = timed(times.retrieval_ms, promising_maps, scan, all_maps);
	std::vector<SearchedMap> maps;
	for (const std::size_t number : numbers) maps.push_back(all_maps[number]);
	Decision result;
	for (const Look& look : looks(maps))
	{
		const auto found = timed(times.retrieval_ms, candidates_of, look, scan, maps);
		if (look.leaves_out(found)) continue;
		const auto places = places_in_maps(found, look, scan, maps, budget, times);
		result = timed(times.refinement_ms, conclude, scan, maps, places);
		if (is_clear(result.answer, parameters.first_look) || budget.is_half_spent()) break;
	}
	result.answer.times = times;
	for (std::size_t& map : result.maps) map = numbers[map];
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
