// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Maps, scans and ground truth of real buildings agree as the library reads them: orientation, origin, thresholds and
// beam order are right together.
#include <d2s1r/grid.h>
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>
#include <mrpt/obs/CRawlog.h>

#include <algorithm>

#include "poses.h"
#include "sites.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
namespace fs = std::filesystem;

struct Site
{
	const char* name;
	double free_area;  //!< [m^2] as its makers state it
};

/// Its name in the list of tests.
void PrintTo(const Site& site, std::ostream* stream)
{
	*stream << site.name;
}

class SiteMap : public testing::TestWithParam<Site>
{
   protected:
	void SetUp() override
	{
		folder_ = sites_folder() / GetParam().name;
		if (!fs::exists(folder_ / "map.yaml")) GTEST_SKIP() << why_skipped(folder_);
	}

	/// |measured - expected| [m] of the returns of the first scans of a log, in increasing order.
	std::vector<double> residuals(const std::string& log) const
	{
		const Grid grid = make_grid(*load_map((folder_ / "map.yaml").string()), {});
		const auto poses = load_poses(folder_ / (log + "_gt.txt"));
		mrpt::obs::CRawlog rawlog;
		EXPECT_TRUE(rawlog.loadFromRawLogFile((folder_ / (log + ".rawlog")).string()));
		EXPECT_EQ(rawlog.size(), poses.size());
		std::vector<double> differences;
		for (std::size_t i = 0; i < std::min<std::size_t>(poses.size(), 40); i++)
		{
			const auto observation = rawlog.asObservation<mrpt::obs::CObservation2DRangeScan>(i);
			const Scan scan = make_scan(d2s1r::scan_of(*observation), {});
			const auto sensor = poses[i].robot + scan.sensor_on_robot;
			for (const Beam& beam : scan.beams)
				if (beam.is_return)
				{
					const double angle = sensor.phi + static_cast<double>(beam.angle);
					const double expected = cast_exactly(grid, sensor.x, sensor.y, angle, 100);
					differences.push_back(std::abs(static_cast<double>(beam.range) - expected));
				}
		}
		std::sort(differences.begin(), differences.end());
		return differences;
	}

	fs::path folder_;
};
}  // namespace

TEST_P(SiteMap, HasTheStatedFreeArea)
{
	const Grid grid = make_grid(*load_map((folder_ / "map.yaml").string()), {});
	const auto cells = std::count(grid.cells.begin(), grid.cells.end(), Cell::kFree);
	EXPECT_NEAR(static_cast<double>(cells) * grid.cell_size * grid.cell_size, GetParam().free_area, 1);
}

TEST_P(SiteMap, ScansEndOnItsWalls)
{
	// [m] median: two thirds of the noise of the simulation, 1 cm (half a degree of yaw more than doubles it); the cell
	// of a map that was made from real scans.
	for (const auto& [log, tolerance] : {std::pair{"sim360_off", 0.01}, {"test", 0.10}})
	{
		if (!fs::exists(folder_ / (std::string(log) + ".rawlog"))) continue;
		const auto sorted = residuals(log);
		ASSERT_FALSE(sorted.empty());
		EXPECT_LT(sorted[sorted.size() / 2], tolerance) << log;
	}
}

INSTANTIATE_TEST_SUITE_P(
    Sites, SiteMap,
    testing::Values(
        Site{"intel", 528}, Site{"fr079", 406}, Site{"mit_csail", 871}, Site{"mit_killian", 3750},
        Site{"fr_campus", 30819}, Site{"willow_garage_005", 1360}, Site{"nav2_warehouse_005", 1274},
        Site{"mit_stata_basement", 782}),
    [](const auto& site) { return std::string(site.param.name); });
}  // namespace d2s1r::test
