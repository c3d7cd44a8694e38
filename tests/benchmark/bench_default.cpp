// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The default method, stage by stage and as a whole.
#include <benchmark/benchmark.h>
#include <d2s1r/localizer.h>

#include <cmath>
#include <random>

#include "coarse/coarse_search.h"
#include "engine/default_localizer.h"
#include "fine/decision.h"
#include "fine/end_point_sums.h"
#include "fine/refinement.h"
#include "literal_query.h"
#include "site_queries.h"

namespace d2s1r::benchmark
{
namespace
{
Parameters parameters_for(const std::string& set)
{
	Parameters parameters;
	parameters.scan.zero_is_no_return = set.rfind("sim", 0) == 0;
	return parameters;
}

/// Simulated scans are of map, real ones of map_test.
std::string map_for(const std::string& set)
{
	return set.rfind("sim", 0) == 0 ? "map" : "map_test";
}

bool is_there(::benchmark::State& state, const std::string& site)
{
	if (!site_is_there(site)) state.SkipWithError("no data: set D2S1R_DATA");
	return site_is_there(site);
}

void localizer_ready(::benchmark::State& state, const std::string& site)
{
	if (!is_there(state, site)) return;
	const auto map = site_map(site);
	for ([[maybe_unused]] auto _ : state)
	{
		const Localizer localizer(map, Parameters{});
		::benchmark::DoNotOptimize(&localizer);
	}
}

void localize(::benchmark::State& state, const std::string& site, const std::string& set)
{
	if (!is_there(state, site)) return;
	const Parameters parameters = parameters_for(set);
	const Localizer localizer(site_map(site, map_for(set)), parameters);
	const auto queries = site_queries(site, set, parameters.scan);
	std::size_t i = 0, successes = 0;
	for ([[maybe_unused]] auto _ : state)
	{
		const Query& query = queries[i++ * 7 % queries.size()];
		const Localization result = localizer.localize(query.scan);
		successes += !result.hypotheses.empty() && is_success(result.best().pose.asTPose(), query.truth) ? 1 : 0;
	}
	state.counters["success"] = static_cast<double>(successes) / static_cast<double>(i);
}

/// The right place and `boxes` others of up to 2 m at random, each of one heading and 0.5 rad to either side; 0:
/// anywhere.
void localize_with_prior(::benchmark::State& state, const std::string& site, int boxes)
{
	if (!is_there(state, site)) return;
	const Localizer localizer(site_map(site));
	const Grid& grid = localizer.grid();
	const auto queries = site_queries(site, "test", {});
	std::mt19937 random(1);
	const auto between = [&](double least, double greatest)
	{ return std::uniform_real_distribution<double>(least, greatest)(random); };
	std::vector<d2s1r::Query> asked(20);  // made beforehand: what is timed does not copy boxes
	for (std::size_t i = 0; boxes > 0 && i < asked.size(); i++)
	{
		const auto add = [&](double x, double y, double yaw) {
			asked[i].prior.boxes.push_back({x, x + between(0, 2), y, y + between(0, 2), yaw, 0.5});
		};
		const auto& truth = queries[i * 7 % queries.size()].truth;
		add(truth.x - 0.1, truth.y - 0.1, truth.phi);
		for (int box = 0; box < boxes; box++)
			add(grid.origin_x + between(0, grid.width * grid.cell_size),
			    grid.origin_y + between(0, grid.height * grid.cell_size), between(-M_PI, M_PI));
	}
	std::size_t i = 0;
	for ([[maybe_unused]] auto _ : state)
	{
		const std::size_t query = i++ % asked.size();
		::benchmark::DoNotOptimize(localizer.localize(queries[query * 7 % queries.size()].scan, asked[query]));
	}
}

/// The stages of one query, each on the results of the one before.
struct Stages
{
	Parameters parameters;
	Prior anywhere;
	DefaultIndex index;
	std::vector<SearchedMap> maps;
	std::vector<Query> queries;

	explicit Stages(const std::string& site)
	    : index(index_of(site, parameters)),
	      maps{index.searched(anywhere, parameters)},
	      queries(site_queries(site, "test", {}))
	{
	}
	Stages(const Stages&) = delete;
	Stages& operator=(const Stages&) = delete;
	static DefaultIndex index_of(const std::string& site, const Parameters& parameters)
	{
		const Grid grid = make_grid(*site_map(site, "map_test"), {});
		return make_default_index(grid, parameters);
	}
	const Scan& scan(std::size_t i) const { return queries[i * 7 % queries.size()].scan; }
	std::vector<Candidate> candidates(const Scan& scan) const
	{
		return CoarseSearch(maps, scan, parameters.coarse_search).candidates(parameters.coarse_search).candidates;
	}
};

void coarse(::benchmark::State& state, const std::string& site)
{
	if (!is_there(state, site)) return;
	const Stages stages(site);
	std::size_t i = 0;
	for ([[maybe_unused]] auto _ : state) ::benchmark::DoNotOptimize(stages.candidates(stages.scan(i++)));
	state.counters["positions"] = static_cast<double>(stages.index.profiles.size());
}

/// One pose among the candidates of a scan.
void sum_ends(::benchmark::State& state, const std::string& site, BeamSubset (*beams_of)(const Scan&))
{
	if (!is_there(state, site)) return;
	const Stages stages(site);
	const BeamSubset beams = beams_of(stages.scan(0));
	const auto candidates = stages.candidates(stages.scan(0));
	const DistanceField& field = stages.index.readings[0].field;
	std::size_t i = 0;
	for ([[maybe_unused]] auto _ : state)
		::benchmark::DoNotOptimize(sum_end_points(
		    field, beams.returns, candidates[i++ % candidates.size()].pose, stages.parameters.refinement.kernel));
}

void refine_and_decide(::benchmark::State& state, const std::string& site, bool decides)
{
	if (!is_there(state, site)) return;
	const Stages stages(site);
	const RefinementParameters& limits = stages.parameters.refinement;
	std::size_t i = 0;
	for ([[maybe_unused]] auto _ : state)
	{
		state.PauseTiming();
		const Scan& scan = stages.scan(i++);
		const BeamSubset few = few_beams(scan), more = many_beams(scan);
		const auto candidates = stages.candidates(scan);
		if (!decides) state.ResumeTiming();
		const auto settled = settle(few, candidates, limits);
		const auto shortlist = make_shortlist(few, settled, limits);
		const auto poses = refine(more, shortlist, limits);
		if (decides)
		{
			state.ResumeTiming();
			const BeamSubset all = all_beams(scan);
			auto places = find_places(scan, all, poses, stages.parameters);
			add_covariances(all, stages.parameters.scoring, places);
			::benchmark::DoNotOptimize(decide(scan, places, stages.maps));
		}
	}
}

BENCHMARK_CAPTURE(localizer_ready, mit_killian, "mit_killian")->Unit(::benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(coarse, intel, "intel")->Unit(::benchmark::kMillisecond)->Iterations(60);
BENCHMARK_CAPTURE(sum_ends, few_intel, "intel", few_beams)->Unit(::benchmark::kMicrosecond)->Iterations(100000);
BENCHMARK_CAPTURE(sum_ends, many_intel, "intel", many_beams)->Unit(::benchmark::kMicrosecond)->Iterations(100000);
BENCHMARK_CAPTURE(refine_and_decide, refine_intel, "intel", false)->Unit(::benchmark::kMillisecond)->Iterations(60);
BENCHMARK_CAPTURE(refine_and_decide, decide_intel, "intel", true)->Unit(::benchmark::kMillisecond)->Iterations(60);
BENCHMARK_CAPTURE(localize, intel_test, "intel", "test")->Unit(::benchmark::kMillisecond)->Iterations(100);
BENCHMARK_CAPTURE(localize, fr079_test, "fr079", "test")->Unit(::benchmark::kMillisecond)->Iterations(100);
BENCHMARK_CAPTURE(localize, mit_killian_test, "mit_killian", "test")->Unit(::benchmark::kMillisecond)->Iterations(60);
BENCHMARK_CAPTURE(localize_with_prior, fr079_anywhere, "fr079", 0)->Unit(::benchmark::kMillisecond)->Iterations(100);
BENCHMARK_CAPTURE(localize_with_prior, fr079_125, "fr079", 125)->Unit(::benchmark::kMillisecond)->Iterations(100);
BENCHMARK_CAPTURE(localize_with_prior, fr079_5000, "fr079", 5000)->Unit(::benchmark::kMillisecond)->Iterations(100);
BENCHMARK_CAPTURE(localize_with_prior, fr079_50000, "fr079", 50000)->Unit(::benchmark::kMillisecond)->Iterations(20);
BENCHMARK_CAPTURE(localize, mit_killian_sim360_off, "mit_killian", "sim360_off")
    ->Unit(::benchmark::kMillisecond)
    ->Iterations(60);
}  // namespace
}  // namespace d2s1r::benchmark
