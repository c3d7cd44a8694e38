// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// make_sites makes folders of sites from corrected CARMEN logs.
#include <cmath>
#include <sstream>

#include "app_process.h"
#include "test_maps.h"

using namespace d2s1r::test;

class MakeSites : public AppTest
{
   protected:
	static constexpr const char* kProgram = D2S1R_BUILD_DIR "/experiments/make_sites";

	void SetUp() override { std::filesystem::create_directories(path("collection/data/carmen")); }

	std::string log() const { return path("collection/data/carmen/intel-corrected.log.gz"); }

	ProcessResult make(const std::string& site) const
	{
		return run_program({kProgram, path("collection"), path("sites"), site});
	}

	/// 12 m x 9 m, no two places alike.
	static d2s1r::Grid flat()
	{
		return make_picture_grid(
		    enlarge(
		        {"########################",  //
		         "#.........#............#",  //
		         "#......................#",  //
		         "#.........#.......##...#",  //
		         "####..#####.......##...#",  //
		         "#.........#............#",  //
		         "#..............##......#",  //
		         "#.........#....##......#",  //
		         "#...#.....#............#",  //
		         "#.........######..######",  //
		         "#.............#........#",  //
		         "#......##..............#",  //
		         "#......................#",  //
		         "########################"},
		        10),
		    0.05);
	}

	/// A drive to and fro, so that its second half sees what its first half has drawn. FLASER: 180 ranges, 1 deg apart
	/// from right to left, the last one at 89 deg; then the corrected pose twice, and a clock that stands still.
	static std::string drive()
	{
		Laser laser;
		laser.beams = 180;
		laser.aperture = 179 * M_PI / 180;
		std::ostringstream lines;
		lines << "# a comment\nPARAM robot_frontlaser_offset 0.0 nohost 0\n";
		for (int i = 0; i < 240; i++)
		{
			const double way = 0.05 * (i < 120 ? i : 239 - i), phi = 0.4 * std::sin(0.3 * i) + (i < 120 ? 0 : M_PI);
			const mrpt::math::TPose2D robot(1.5 + way, 1.2, phi);
			const auto scan = make_observation(flat(), {robot.x, robot.y, phi - M_PI / 360}, laser);
			lines << "ODOM " << way << " 0 " << phi << " 0 0 0 0 pippo 0\nFLASER 180";
			for (std::size_t b = 0; b < scan.getScanSize(); b++) lines << ' ' << scan.getScanRange(b);
			for (int copy = 0; copy < 2; copy++) lines << ' ' << robot.x << ' ' << robot.y << ' ' << robot.phi;
			lines << " 0 pippo 0\n";
		}
		return lines.str();
	}
};

TEST_F(MakeSites, MapsScansAndTruthOfALogFitTogether)
{
	write_file(log(), drive());
	const ProcessResult made = make("intel");
	ASSERT_EQ(made.status, 0) << made.err;
	const std::string site = path("sites/intel");
	const auto result = run(
	    {"-m", site + "/map_test.yaml", "-i", site + "/test.rawlog", "-o", path("out"), "--ground-truth",
	     site + "/test_gt.txt"});
	ASSERT_EQ(result.status, 0) << result.err;
	const CsvTable frames(path("out/frames.csv"), kFramesHeader);
	EXPECT_GE(frames.size(), 15U) << read_file(site + "/info.txt");
	std::size_t localized = 0;
	for (std::size_t i = 0; i < frames.size(); i++)
	{
		if (frames.text(i, "status") != "localized") continue;
		localized++;
		EXPECT_NEAR(frames.number(i, "y"), 1.2, 0.1) << "frame " << i;
	}
	EXPECT_GE(localized, 0.5 * static_cast<double>(frames.size()));
	const auto all = run({"-m", site + "/map.yaml", "-i", site + "/run.rawlog", "-o", path("run"), "--frames", "0:3"});
	ASSERT_EQ(all.status, 0) << all.err;
	EXPECT_EQ(lines_of(read_file(site + "/run_gt.txt")).size(), 241U)
	    << "a line for each scan, and one that names them";
}

TEST_F(MakeSites, DamagedLogsAndUnknownSitesAreNamed)
{
	write_file(log(), "FLASER 180 1 2 3\n");
	const ProcessResult damaged = make("intel");
	EXPECT_EQ(damaged.status, 1);
	EXPECT_NE(damaged.err.find("intel-corrected.log.gz:1: is too short"), std::string::npos) << damaged.err;
	write_file(log(), "ODOM 0 0 0 0 0 0 0 pippo 0\n");
	EXPECT_NE(make("intel").err.find("holds no line FLASER"), std::string::npos);
	EXPECT_NE(make("aces").err.find("cannot be read"), std::string::npos);
	EXPECT_EQ(make("castle").status, 1);
}
