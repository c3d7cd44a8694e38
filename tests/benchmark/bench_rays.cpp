// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// BeamSubset: all at once, one by one, and MRPT's simulator.
#include <benchmark/benchmark.h>
#include <d2s1r/mrpt.h>
#include <mrpt/obs/CObservation2DRangeScan.h>

#include <random>

#include "ranges/range_sweep.h"
#include "ranges/ray_caster.h"
#include "site_queries.h"
#include "unit/test_maps.h"

namespace d2s1r::benchmark
{
namespace
{
constexpr double kMaxRange = 30;  // [m]
constexpr const char* kSite = "mit_killian";

struct RaySite
{
	Grid grid = make_grid(*site_map(kSite), {});
	std::vector<CellIndex> cells = find_free_cells(grid, {});
};

const RaySite* site(::benchmark::State& state)
{
	if (!site_is_there(kSite)) return state.SkipWithError("no data: set D2S1R_DATA"), nullptr;
	static const RaySite loaded;
	return &loaded;
}

void report_rays(::benchmark::State& state, std::size_t rays_of_iteration)
{
	const auto rays = static_cast<double>(rays_of_iteration) * static_cast<double>(state.iterations());
	state.counters["s_per_ray"] =
	    ::benchmark::Counter(rays, ::benchmark::Counter::kIsRate | ::benchmark::Counter::kInvert);
}

/// Centres of random free cells.
std::vector<CellIndex> some_cells(const RaySite& site, std::size_t n)
{
	std::mt19937 random(1);
	std::vector<CellIndex> cells;
	for (std::size_t i = 0; i < n; i++) cells.push_back(site.cells[random() % site.cells.size()]);
	return cells;
}

void sweep_all_free_cells(::benchmark::State& state)
{
	const RaySite* the = site(state);
	if (!the) return;
	const int directions = 180;
	std::vector<std::uint16_t> by_cell(the->cells.size());
	for ([[maybe_unused]] auto _ : state)
		RangeSweep{the->grid}(
		    the->cells, directions, kMaxRange,
		    [&](int, const SweptRanges& ranges)
		    {
			    for (std::size_t i = 0; i < by_cell.size(); i++) by_cell[i] = ranges[i];
			    ::benchmark::DoNotOptimize(by_cell.data());
		    });
	report_rays(state, directions * the->cells.size());
}
BENCHMARK(sweep_all_free_cells)->Unit(::benchmark::kMillisecond);

void virtual_scan_360(::benchmark::State& state)
{
	const RaySite* the = site(state);
	if (!the) return;
	static const RayCaster caster(the->grid, kMaxRange);
	const std::vector<CellIndex> cells = some_cells(*the, 1000);
	std::vector<float> ranges;
	std::size_t i = 0;
	for ([[maybe_unused]] auto _ : state)
	{
		const CellIndex cell = cells[i++ % cells.size()];
		caster.scan(the->grid.center_x(cell), the->grid.center_y(cell), 360, ranges);
		::benchmark::DoNotOptimize(ranges.data());
	}
	report_rays(state, 360);
}
BENCHMARK(virtual_scan_360)->Unit(::benchmark::kMicrosecond);

void single_exact_ray(::benchmark::State& state)
{
	const RaySite* the = site(state);
	if (!the) return;
	static const RayCaster caster(the->grid, kMaxRange);
	const std::vector<CellIndex> cells = some_cells(*the, 1000);
	std::size_t i = 0;
	for ([[maybe_unused]] auto _ : state)
	{
		const CellIndex cell = cells[i % cells.size()];
		::benchmark::DoNotOptimize(
		    caster.cast(the->grid.center_x(cell), the->grid.center_y(cell), static_cast<double>(i++ % 360)));
	}
	report_rays(state, 1);
}
BENCHMARK(single_exact_ray)->Unit(::benchmark::kNanosecond);

void literal_cell_by_cell(::benchmark::State& state)
{
	const RaySite* the = site(state);
	if (!the) return;
	const std::vector<CellIndex> cells = some_cells(*the, 1000);
	std::size_t i = 0;
	for ([[maybe_unused]] auto _ : state)
	{
		const CellIndex cell = cells[i % cells.size()];
		::benchmark::DoNotOptimize(test::cast_exactly(
		    the->grid, the->grid.center_x(cell), the->grid.center_y(cell), static_cast<double>(i++ % 360), kMaxRange));
	}
	report_rays(state, 1);
}
BENCHMARK(literal_cell_by_cell)->Unit(::benchmark::kNanosecond);

/// MRPT's own; its rays are 0.8 times as long as asked for.
void mrpt_laser_scan_simulator(::benchmark::State& state)
{
	const RaySite* the = site(state);
	if (!the) return;
	const auto map = mrpt_grid_of(*site_map(kSite));
	const std::vector<CellIndex> cells = some_cells(*the, 1000);
	mrpt::obs::CObservation2DRangeScan scan;
	scan.aperture = static_cast<float>(2 * M_PI * 359 / 360);
	scan.maxRange = static_cast<float>(kMaxRange);
	std::size_t i = 0;
	for ([[maybe_unused]] auto _ : state)
	{
		const CellIndex cell = cells[i++ % cells.size()];
		const mrpt::poses::CPose2D pose(the->grid.center_x(cell), the->grid.center_y(cell), 0);
		map->laserScanSimulator(scan, pose, 0.6F, 360);
	}
	report_rays(state, 360);
}
BENCHMARK(mrpt_laser_scan_simulator)->Unit(::benchmark::kMicrosecond);
}  // namespace
}  // namespace d2s1r::benchmark
