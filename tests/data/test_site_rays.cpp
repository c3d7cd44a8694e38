// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Swept ranges on the maps of real buildings.
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>

#include "map/free_cells.h"
#include "ranges/range_sweep.h"
#include "ranges/ray_caster.h"
#include "sites.h"

namespace d2s1r::test
{
namespace
{
constexpr double kMaxRange = 30;  // [m]
constexpr int kDirections = 45;

/// Counts ranges more than a cell off exact ones.
struct Check
{
	RayCaster caster;
	std::size_t off = 0;

	void count(const Grid& grid, CellIndex cell, double angle, std::uint16_t swept)
	{
		const auto exact = static_cast<double>(caster.cast(grid.center_x(cell), grid.center_y(cell), angle));
		const double range = swept == kNoObstacle ? kMaxRange : swept * grid.cell_size / kRangeUnitsPerCell;
		off += std::abs(range - exact) > grid.cell_size ? 1 : 0;
	}
};

class SiteRays : public testing::TestWithParam<const char*>
{
};

TEST_P(SiteRays, NinetyNinePercentOfSweptRaysAreWithinACell)
{
	const auto file = sites_folder() / GetParam() / "map.yaml";
	if (!std::filesystem::exists(file)) GTEST_SKIP() << why_skipped(file);
	const Grid grid = make_grid(*load_map(file.string()), {});
	const auto free = find_free_cells(grid, {});
	std::vector<CellIndex> cells;
	for (std::size_t i = 0; i < free.size(); i += 1 + free.size() / 5000) cells.push_back(free[i]);
	Check check{RayCaster(grid, kMaxRange)};
	RangeSweep{grid}(
	    cells, kDirections, kMaxRange,
	    [&](int direction, const SweptRanges& ranges)
	    {
		    const double angle = 2 * M_PI * direction / kDirections;
		    for (std::size_t i = 0; i < cells.size(); i++) check.count(grid, cells[i], angle, ranges[i]);
	    });
	EXPECT_LT(check.off, cells.size() * static_cast<std::size_t>(kDirections) / 100);
}

INSTANTIATE_TEST_SUITE_P(
    Sites, SiteRays,
    testing::Values(
        "intel", "fr079", "mit_csail", "mit_killian", "fr_campus", "willow_garage_005", "nav2_warehouse_005"),
    [](const auto& site) { return std::string(site.param); });
}  // namespace
}  // namespace d2s1r::test
