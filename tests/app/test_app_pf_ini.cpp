// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Where --write-pf-ini lets pf-localization start.
#include <mrpt/config/CConfigFile.h>

#include <algorithm>
#include <cmath>

#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;

class AppPfIni : public AppTest
{
   protected:
	/// Runs on one scan with that noise [m] of ranges, and expects the box round its pose.
	void expect_box(double range_noise, double least_deviation, double greatest_deviation)
	{
		save_gridmap(flat(), path("flat.gridmap.gz"));
		save({walk_scan(7)}, path("in.rawlog"));
		write_file(path("own.ini"), "[refinement]\nrange_noise = " + std::to_string(range_noise) + "\n");
		const auto result = run(
		    {"-q", "-m", path("flat.gridmap.gz"), "-i", path("in.rawlog"), "-o", path("out"), "-c", path("own.ini"),
		     "--write-pf-ini", path("pf.ini")});
		ASSERT_EQ(result.status, 0) << result.err;
		const CsvTable frames(path("out/frames.csv"), kFramesHeader);
		const auto expect = [&](const std::string& key, const std::string& axis, double unit, double least)
		{
			const double mean = frames.number(0, axis) * unit, deviation = frames.number(0, "std_" + axis) * unit;
			EXPECT_GE(frames.number(0, "std_" + axis), least_deviation);
			EXPECT_LE(frames.number(0, "std_" + axis), greatest_deviation);
			const double half = std::max(least, 3 * deviation);
			const mrpt::config::CConfigFile ini(path("pf.ini"));
			EXPECT_NEAR(ini.read_double("LocalizationExperiment", "init_PDF_min_" + key, 0), mean - half, 2e-3) << key;
			EXPECT_NEAR(ini.read_double("LocalizationExperiment", "init_PDF_max_" + key, 0), mean + half, 2e-3) << key;
		};
		expect("x", "x", 1, 0.3);
		expect("y", "y", 1, 0.3);
		expect("yaw_deg", "phi", 180 / M_PI, 5);
	}
};

TEST_F(AppPfIni, TheBoxHoldsThreeDeviationsOfTheFirstPose)
{
	expect_box(3, 0.03, 1);
}

TEST_F(AppPfIni, TheBoxIsNeverTooSmallForTheParticles)
{
	expect_box(0.03, 0, 0.02);
}
