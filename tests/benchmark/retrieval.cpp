// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Share of queries whose ten candidates hold a cell within 0.2 m of the truth: by the index, and by exact search on the
// full histograms of exactly cast rays. Prints a line of CSV a set: site, set, queries, index, exact, success.

#include <iostream>

#include "literal_query.h"
#include "paper/paper_localizer.h"
#include "site_queries.h"

namespace
{
using namespace d2s1r;
using namespace d2s1r::benchmark;

void run(const std::string& site)
{
	const Parameters parameters;
	const Grid grid = make_grid(*site_map(site), {});
	const auto cells = find_free_cells(grid, {});
	const SignatureIndex index(grid, cells, parameters);
	const RayCaster caster(grid, parameters.paper.max_range);
	const LiteralLocalizer literal(grid, caster, cells);
	const auto holds = [&](CellIndex cell, const mrpt::math::TPose2D& truth)
	{ return std::hypot(grid.center_x(cell) - truth.x, grid.center_y(cell) - truth.y) < 0.2; };
	for (const std::string set : {"sim360_on", "sim360_off", "sim360_clutter"})
	{
		if (!std::filesystem::exists(test::sites_folder() / site / (set + ".rawlog"))) continue;
		const auto queries = site_queries(site, set, simulated_scans());
		std::size_t by_index = 0, by_exact = 0, successes = 0;
		for (const auto& [scan, truth] : queries)
		{
			const auto ours = index.nearest(make_signature(scan, parameters.paper), 10);
			const auto exact = literal.nearest(scan, 10);
			const auto ours_holds = [&, t = truth](const NearestCell& found) { return holds(found.cell, t); };
			by_index += std::any_of(ours.begin(), ours.end(), ours_holds) ? 1 : 0;
			by_exact +=
			    std::any_of(exact.begin(), exact.end(), [&, t = truth](CellIndex c) { return holds(c, t); }) ? 1 : 0;
			const auto result = localize_paper(scan, grid, index, caster, parameters.paper);
			successes += is_success(result.best().pose.asTPose(), truth) ? 1 : 0;
		}
		const auto n = static_cast<double>(queries.size());
		std::cout << site << ',' << set << ',' << queries.size() << ',' << static_cast<double>(by_index) / n << ','
		          << static_cast<double>(by_exact) / n << ',' << static_cast<double>(successes) / n << std::endl;
	}
}
}  // namespace

int main(int argc, char** argv)
{
	for (int i = 1; i < argc; i++)
		if (site_is_there(argv[i]))
			run(argv[i]);
		else
			std::cerr << argv[i] << ": no data: set D2S1R_DATA" << std::endl;
	return 0;
}
