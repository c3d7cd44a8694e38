// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The published method, stage by stage, and its literal transcription.
#include <benchmark/benchmark.h>

#include "literal_query.h"
#include "paper/paper_localizer.h"
#include "paper/signature_counts.h"
#include "site_queries.h"

namespace d2s1r::benchmark
{
namespace
{
/// What all queries of a site share.
struct Site
{
	Parameters parameters;
	Grid grid;
	std::vector<CellIndex> cells;
	RayCaster caster;
	SignatureIndex index;
	std::vector<Query> queries;

	explicit Site(const std::string& name)
	    : grid(make_grid(*site_map(name), {})),
	      cells(find_free_cells(grid, {})),
	      caster(grid, parameters.paper.max_range),
	      index(grid, cells, parameters),
	      queries(site_queries(name, "sim360_off", simulated_scans()))
	{
	}
};

/// Loaded once; the benchmarks of a site follow each other, so that only one is in memory.
const Site* load(::benchmark::State& state, const std::string& name)
{
	if (!site_is_there(name)) return state.SkipWithError("no data: set D2S1R_DATA"), nullptr;
	static std::string loaded;
	static std::unique_ptr<const Site> site;
	if (loaded != name)
	{
		site.reset();
		site = std::make_unique<const Site>(name);
		loaded = name;
	}
	return site.get();
}

void count_signatures(::benchmark::State& state, const std::string& name)
{
	const Site* site = load(state, name);
	if (!site) return;
	for ([[maybe_unused]] auto _ : state)
		::benchmark::DoNotOptimize(d2s1r::count_signatures(site->grid, site->cells, site->parameters).counts.data());
	const double rays = 360.0 * static_cast<double>(site->cells.size()) * static_cast<double>(state.iterations());
	state.counters["s_per_ray"] =
	    ::benchmark::Counter(rays, ::benchmark::Counter::kIsRate | ::benchmark::Counter::kInvert);
}

void build_index(::benchmark::State& state, const std::string& name)
{
	const Site* site = load(state, name);
	if (!site) return;
	for ([[maybe_unused]] auto _ : state)
	{
		const SignatureIndex index(site->grid, site->cells, site->parameters);
		::benchmark::DoNotOptimize(&index);
	}
}

void retrieve(::benchmark::State& state, const std::string& name)
{
	const Site* site = load(state, name);
	if (!site) return;
	Signature signature;
	std::vector<NearestCell> cells;
	std::size_t i = 0;
	for ([[maybe_unused]] auto _ : state)
	{
		make_signature(site->queries[i++ % site->queries.size()].scan, site->parameters.paper, signature);
		site->index.nearest(signature, 10, cells);
	}
}

void register_one_candidate(::benchmark::State& state, const std::string& name)
{
	const Site* site = load(state, name);
	if (!site) return;
	const ResampledScan scan = resample(site->queries[0].scan, site->parameters.paper);
	const auto cell = site->cells[site->cells.size() / 2];
	const auto ranges = site->caster.scan(site->grid.center_x(cell), site->grid.center_y(cell), 360);
	for ([[maybe_unused]] auto _ : state)
		::benchmark::DoNotOptimize(register_yaw(scan, ranges, site->parameters.paper));
}

void query(::benchmark::State& state, const std::string& name)
{
	const Site* site = load(state, name);
	if (!site) return;
	std::size_t i = 0, successes = 0;
	for ([[maybe_unused]] auto _ : state)
	{
		const Query& q = site->queries[i++ % site->queries.size()];
		const auto result = localize_paper(q.scan, site->grid, site->index, site->caster, site->parameters.paper);
		successes += is_success(result.best().pose.asTPose(), q.truth) ? 1 : 0;
	}
	state.counters["success"] = static_cast<double>(successes) / static_cast<double>(i);
}

void literal_query(::benchmark::State& state, const std::string& name)
{
	const Site* site = load(state, name);
	if (!site) return;
	static std::string of;  // built once for all repetitions
	static std::unique_ptr<const LiteralLocalizer> literal;
	if (of != name)
	{
		literal = std::make_unique<const LiteralLocalizer>(site->grid, site->caster, site->cells);
		of = name;
	}
	std::size_t i = 0, successes = 0;
	for ([[maybe_unused]] auto _ : state)
	{
		const Query& q = site->queries[i++ % site->queries.size()];
		successes += is_success(literal->localize(q.scan), q.truth) ? 1 : 0;
	}
	state.counters["success"] = static_cast<double>(successes) / static_cast<double>(i);
}

BENCHMARK_CAPTURE(count_signatures, mit_killian, "mit_killian")->Unit(::benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(build_index, mit_killian, "mit_killian")->Unit(::benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(retrieve, mit_killian, "mit_killian")->Unit(::benchmark::kMicrosecond)->Iterations(500);
BENCHMARK_CAPTURE(register_one_candidate, mit_killian, "mit_killian")->Unit(::benchmark::kMicrosecond);
BENCHMARK_CAPTURE(query, mit_killian, "mit_killian")->Unit(::benchmark::kMicrosecond)->Iterations(500);
BENCHMARK_CAPTURE(build_index, intel, "intel")->Unit(::benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(query, intel, "intel")->Unit(::benchmark::kMicrosecond)->Iterations(500);
BENCHMARK_CAPTURE(literal_query, intel, "intel")->Unit(::benchmark::kMicrosecond)->Iterations(100);
BENCHMARK_CAPTURE(query, mit_csail, "mit_csail")->Unit(::benchmark::kMicrosecond)->Iterations(500);
BENCHMARK_CAPTURE(literal_query, mit_csail, "mit_csail")->Unit(::benchmark::kMicrosecond)->Iterations(100);
BENCHMARK_CAPTURE(literal_query, mit_killian, "mit_killian")->Unit(::benchmark::kMicrosecond)->Iterations(100);
}  // namespace
}  // namespace d2s1r::benchmark
