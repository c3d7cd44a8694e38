// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// make_sites makes folders of sites from corrected CARMEN logs and the raw logs of the same drives.
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/serialization/CArchive.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <sstream>

#include "app_process.h"
#include "app_world.h"
#include "counted_map.h"
#include "mrpt_types.h"
#include "test_maps.h"

using namespace d2s1r::test;
using mrpt::obs::CObservation2DRangeScan;

class MakeSites : public AppTest
{
   protected:
	static constexpr const char* kProgram = D2S1R_BUILD_DIR "/experiments/make_sites";
	static constexpr const char* kKnowledgeHeader = "timestamp,on_walls,doubtful";

	void SetUp() override
	{
		std::filesystem::create_directories(path("collection/data/carmen"));
		std::filesystem::create_directories(path("raw/datasets/radish"));
	}

	/// Of a site whose test scans come from the corrected log.
	std::string log() const { return path("collection/data/carmen/freiburg-079-corrected.log.gz"); }

	ProcessResult make(const std::string& site) const
	{
		return run_program({kProgram, path("collection"), path("raw"), path("sites"), site});
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

	/// Where the robot is at a step of its drive to and fro, so that the second half sees what the first half has
	/// drawn.
	static mrpt::math::TPose2D robot_at(int i)
	{
		const double way = 0.05 * (i < 120 ? i : 239 - i);
		return {1.5 + way, 1.2, 0.4 * std::sin(0.3 * i) + (i < 120 ? 0 : M_PI)};
	}

	/// Its scan: 180 ranges from right to left, the last one a beam before 90 deg, rounded to centimetres.
	static CObservation2DRangeScan scan_at(int i, double degrees_per_beam)
	{
		Laser laser;
		laser.beams = static_cast<std::size_t>(180 / degrees_per_beam);
		laser.aperture = M_PI - degrees_per_beam * M_PI / 180;
		const auto robot = robot_at(i);
		auto scan = make_mrpt_observation(flat(), {robot.x, robot.y, robot.phi - degrees_per_beam * M_PI / 360}, laser);
		for (std::size_t b = 0; b < scan.getScanSize(); b++)
			scan.setScanRange(b, std::round(100 * scan.getScanRange(b)) / 100);
		return scan;
	}

	/// Every `stride`-th scan as FLASER: its ranges, then the corrected pose twice, and a clock that stands still. The
	/// corrected poses are off to and fro by `wrong`, and five of them, from scan 200 on, are `jump` [m] off.
	static std::string drive(double degrees_per_beam, int stride = 1, double wrong = 0, double jump = 0)
	{
		std::ostringstream lines;
		lines << "# a comment\nPARAM robot_frontlaser_offset 0.0 nohost 0\n";
		for (int i = 0; i < 240; i += stride)
		{
			const auto robot = robot_at(i);
			const auto scan = scan_at(i, degrees_per_beam);
			const double off = wrong * std::sin(1.7 * i) + (i >= 200 && i < 205 ? jump : 0);
			lines << "ODOM " << robot.x << " 0 " << robot.phi << " 0 0 0 0 pippo 0\nFLASER " << scan.getScanSize();
			for (std::size_t b = 0; b < scan.getScanSize(); b++) lines << ' ' << scan.getScanRange(b);
			for (int copy = 0; copy < 2; copy++)
				lines << ' ' << robot.x + off << ' ' << robot.y - off << ' ' << robot.phi;
			lines << " 0 pippo 0\n";
		}
		return lines.str();
	}

	/// All scans of the drive, with an odometry in a frame of its own that stretches ways by 2 %.
	static void save_raw_log(const std::string& file, int scans)
	{
		mrpt::io::CFileGZOutputStream stream(file);
		auto archive = mrpt::serialization::archiveFrom(stream);
		for (int i = 0; i < scans; i++)
		{
			const auto robot = robot_at(i);
			mrpt::obs::CObservationOdometry odometry;
			odometry.odometry =
			    mrpt::poses::CPose2D(100, -7, 2) + mrpt::poses::CPose2D(1.02 * robot.x, robot.y, robot.phi);
			archive << odometry << scan_at(i, 1);
		}
	}

	/// How far poses of a file of truth are from the drive, in the mean [m].
	double mean_error(const std::string& truth) const
	{
		std::istringstream lines(read_file(truth));
		std::string line;
		std::getline(lines, line);
		double time = 0, x = 0, y = 0, phi = 0, sum = 0;
		int count = 0;
		while (lines >> time >> x >> y >> phi)
		{
			const auto robot = robot_at(static_cast<int>(std::lround((time - 1e9) / 0.2)));
			sum += std::hypot(x - robot.x, y - robot.y);
			count++;
		}
		EXPECT_GT(count, 0);
		return sum / count;
	}
};

TEST_F(MakeSites, MapsScansAndTruthOfALogFitTogether)
{
	write_file(log(), drive(0.5));
	const ProcessResult made = make("fr079");
	ASSERT_EQ(made.status, 0) << made.err;
	const std::string site = path("sites/fr079");
	const auto result = run(
	    {"-m", site + "/map_test.yaml", "-i", site + "/test.rawlog", "-o", path("out"), "--ground-truth",
	     site + "/test_gt.txt"});
	ASSERT_EQ(result.status, 0) << result.err;
	const CsvTable frames(path("out/frames.csv"), kFramesHeader);
	const CsvTable scans(site + "/test_scans.csv", kKnowledgeHeader);
	ASSERT_EQ(frames.size(), scans.size()) << read_file(site + "/info.txt");
	std::size_t localized = 0, in_map = 0;
	for (std::size_t i = 0; i < frames.size(); i++)
	{
		if (scans.number(i, "on_walls") < 0.5) continue;
		in_map++;
		if (frames.text(i, "status") != "localized") continue;
		localized++;
		EXPECT_NEAR(frames.number(i, "y"), 1.2, 0.1) << "frame " << i;
	}
	EXPECT_GE(in_map, 15U);
	EXPECT_GE(localized, 0.5 * static_cast<double>(in_map));
	const auto all = run({"-m", site + "/map.yaml", "-i", site + "/run.rawlog", "-o", path("run"), "--frames", "0:3"});
	ASSERT_EQ(all.status, 0) << all.err;
	EXPECT_EQ(lines_of(read_file(site + "/run_gt.txt")).size(), 241U)
	    << "a line for each scan, and one that names them";
}

TEST_F(MakeSites, EveryScanOfTheDriveIsThereWithWhatTheLogSaysOfIt)
{
	const auto doubtful = [&](double jump)
	{
		write_file(log(), drive(0.5, 1, 0, jump));
		EXPECT_EQ(make("fr079").status, 0);
		const CsvTable scans(path("sites/fr079/test_scans.csv"), kKnowledgeHeader);
		EXPECT_GE(scans.size(), 23U) << "the way back, one scan per 0.25 m, or more where the robot turns";
		EXPECT_EQ(scans.size() + 1, lines_of(read_file(path("sites/fr079/test_gt.txt"))).size());
		std::vector<int> found;
		std::size_t in_map = 0;
		for (std::size_t i = 0; i < scans.size(); i++)
		{
			const double on_walls = scans.number(i, "on_walls");
			EXPECT_TRUE(on_walls >= 0 && on_walls <= 1) << i;
			in_map += on_walls >= 0.5 ? 1 : 0;
			if (scans.number(i, "doubtful") > 0)
				found.push_back(static_cast<int>(std::lround((scans.number(i, "timestamp") - 1e9) / 0.2)));
		}
		EXPECT_TRUE(in_map >= 15 && in_map < scans.size()) << in_map << ": the way out looks the other way";
		return found;
	};
	EXPECT_TRUE(doubtful(0).empty());
	const std::vector<int> found = doubtful(0.25);
	EXPECT_FALSE(found.empty());
	for (const int scan : found) EXPECT_TRUE(scan > 190 && scan < 215) << scan << ": neither the jump nor beside it";
}

TEST_F(MakeSites, SimulatedScansAreFoundInTheMap)
{
	write_file(log(), drive(0.5));
	ASSERT_EQ(make("fr079").status, 0);
	const std::string site = path("sites/fr079");
	for (const std::string set : {"sim360_on", "sim360_off", "sim360_clutter", "sim270_off"})
	{
		const std::size_t scans = set == "sim360_on" ? 240 : 500;  // the drive has no more
		EXPECT_EQ(lines_of(read_file(site + "/" + set + "_gt.txt")).size(), scans + 1) << set;
		const auto found = load(site + "/" + set + ".rawlog");
		ASSERT_EQ(found.size(), scans) << set;
		const auto& scan = dynamic_cast<const CObservation2DRangeScan&>(*found[7]);
		EXPECT_NEAR(scan.aperture, (set == "sim270_off" ? 270 : 359) * M_PI / 180, 1e-5) << set;
		const auto result = run(
		    {"-m", site + "/map.yaml", "-i", site + "/" + set + ".rawlog", "-o", path(set), "--ground-truth",
		     site + "/" + set + "_gt.txt", "--frames", "::10"});
		ASSERT_EQ(result.status, 0) << result.err;
		const auto summary = nlohmann::json::parse(read_file(path(set + "/summary.json")))["accuracy_0.3m_5deg"];
		EXPECT_GE(summary["successes"].get<double>(), 0.8 * summary["frames"].get<double>()) << set;
	}
}

TEST_F(MakeSites, WrongPosesOfALogAreMadeToFitEachOther)
{
	constexpr double kWrong = 0.06;  // [m]
	write_file(log(), drive(0.5, 1, kWrong));
	const ProcessResult made = make("fr079");
	ASSERT_EQ(made.status, 0) << made.err;
	EXPECT_LT(mean_error(path("sites/fr079/run_gt.txt")), 0.75 * kWrong) << "they were 0.9 of it off";
}

TEST_F(MakeSites, ScansOfTheRawLogBetweenCorrectedOnesGetATruth)
{
	constexpr int kStride = 6;
	write_file(path("collection/data/carmen/intel-corrected.log.gz"), drive(1, kStride));
	const std::string raw = path("raw/datasets/radish/intel.rawlog");
	EXPECT_NE(make("intel").err.find("intel.rawlog: cannot be read"), std::string::npos);
	save_raw_log(raw, 239);
	const ProcessResult made = make("intel");
	ASSERT_EQ(made.status, 0) << made.err;
	const std::string info = read_file(path("sites/intel/info.txt"));
	EXPECT_NE(info.find("40 scans; 20 draw map_test; of 115 others"), std::string::npos) << info;
	EXPECT_GE(lines_of(read_file(path("sites/intel/test_gt.txt"))).size(), 15U) << info;
	std::istringstream truths(read_file(path("sites/intel/test_gt.txt")));
	const CsvTable scans(path("sites/intel/test_scans.csv"), kKnowledgeHeader);
	std::string in_map, truth;
	for (std::size_t i = 0; i <= scans.size() && std::getline(truths, truth); i++)
		if (i == 0 || scans.number(i - 1, "on_walls") >= 0.5) in_map += truth + '\n';
	write_file(path("in_map_gt.txt"), in_map);
	EXPECT_LT(mean_error(path("in_map_gt.txt")), 0.05);
	save_raw_log(raw, 200);
	EXPECT_NE(make("intel").err.find("lacks scan 14 of those that follow"), std::string::npos) << make("intel").err;
}

TEST(CountedMap, ACellIsAWallIfMoreThanAQuarterOfTheScansEndInIt)
{
	const auto scan_to = [](float range)
	{
		auto scan = CObservation2DRangeScan::Create();
		scan->aperture = 0.01F;
		scan->resizeScan(3);
		for (std::size_t i = 0; i < 3; i++) scan->setScanRange(i, range), scan->setScanRangeValidity(i, true);
		return d2s1r::experiments::PlacedScan{scan, mrpt::poses::CPose2D(0.025, 0.025, 0)};
	};
	std::vector<d2s1r::experiments::PlacedScan> scans{scan_to(1), scan_to(2), scan_to(2)};
	const auto cell = [](const auto& map, float x) { return map->getCell(map->x2idx(x), map->y2idx(0.025F)); };
	auto map = d2s1r::experiments::count_map(scans, 0.05, 3);
	EXPECT_LT(cell(map, 1.025F), 0.1F) << "one of three";
	EXPECT_LT(cell(map, 2.025F), 0.1F);
	EXPECT_GT(cell(map, 1.525F), 0.9F) << "two passed it";
	EXPECT_NEAR(cell(map, 2.525F), 0.5F, 0.01F) << "behind all returns";
	scans.push_back(scan_to(2));
	map = d2s1r::experiments::count_map(scans, 0.05, 3);
	EXPECT_GT(cell(map, 1.025F), 0.9F) << "one of four";
	map = d2s1r::experiments::count_map(scans, 0.05, 1.5);
	EXPECT_LT(cell(map, 1.025F), 0.1F) << "longer beams draw nothing";
	EXPECT_NEAR(cell(map, 0.525F), 0.98F, 0.01F);
	EXPECT_NEAR(cell(map, 1.225F), 0.5F, 0.01F);
}

TEST_F(MakeSites, DamagedLogsAndUnknownSitesAreNamed)
{
	write_file(log(), "FLASER 180 1 2 3\n");
	const ProcessResult damaged = make("fr079");
	EXPECT_EQ(damaged.status, 1);
	EXPECT_NE(damaged.err.find("freiburg-079-corrected.log.gz:1: is too short"), std::string::npos) << damaged.err;
	write_file(log(), "ODOM 0 0 0 0 0 0 0 pippo 0\n");
	EXPECT_NE(make("fr079").err.find("holds no line FLASER"), std::string::npos);
	EXPECT_NE(make("aces").err.find("cannot be read"), std::string::npos);
	const ProcessResult unknown = make("castle");
	EXPECT_EQ(unknown.status, 1);
	EXPECT_EQ(unknown.err.rfind("make_sites: 'castle' is not a site that can be made; choose from intel, ", 0), 0U)
	    << unknown.err;
}
