// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Runs every pipeline of share/d2s1r/examples.
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/serialization/CArchive.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "fake_laser.h"
#include "mrpt_types.h"
#include "shell.h"

using d2s1r::test::run_command;
using d2s1r::test::why_not;

namespace
{
const std::string kDemo = "/usr/share/mrpt/datasets/localization_demo";
const std::string kExamples = D2S1R_SOURCE_DIR "/share/d2s1r/examples/";

/// 12 m x 9 m, no two places alike.
const d2s1r::Grid kFlat = d2s1r::test::make_picture_grid(
    d2s1r::test::enlarge(
        {"########################",  //
         "#.........#............#",  //
         "#.........#............#",  //
         "#......................#",  //
         "#.........#.......##...#",  //
         "#.........#.......##...#",  //
         "####..#####............#",  //
         "#.........#............#",  //
         "#..............##......#",  //
         "#.........#....##......#",  //
         "#...#.....#............#",  //
         "#.........######..######",  //
         "#......................#",  //
         "#.............#........#",  //
         "#......................#",  //
         "#......##..............#",  //
         "#......................#",  //
         "########################"},
        10),
    0.05);

/// Robot in map.
std::vector<mrpt::math::TPose2D> flat_path()
{
	std::vector<mrpt::math::TPose2D> path;
	for (int i = 0; i < 12; i++) path.emplace_back(2.0 + 0.5 * i, 1.9, 0.05 * i);
	return path;
}

class Examples : public testing::Test
{
   protected:
	void SetUp() override
	{
		for (const char* app : {"pf-localization", "rawlog-edit", "simul-gridmap", "carmen2rawlog", "rawlog-grabber"})
			if (const auto why = why_not(app, D2S1R_MODULE); !why.empty()) GTEST_SKIP() << why;
		if (!std::filesystem::exists(kDemo + ".rawlog")) GTEST_SKIP() << kDemo << ".rawlog is missing (mrpt-common)";
		std::filesystem::create_directories(folder_);
	}
	void TearDown() override { std::filesystem::remove_all(folder_); }

	std::string path(const std::string& name) const { return folder_ + "/" + name; }

	static void run(const std::string& script_and_arguments)
	{
		const auto result = run_command("RAWLOG_LOCALIZE=" RAWLOG_LOCALIZE " " + kExamples + script_and_arguments);
		ASSERT_EQ(result.status, 0) << result.output;
	}

	/// Steps of pf-localization, in the order of its output: x [m], y [m], phi [deg], map frame.
	std::vector<std::array<double, 3>> pf_poses(const std::string& out) const
	{
		std::ifstream file(out + "/pf_poses.txt");
		std::vector<std::array<double, 3>> poses;
		for (std::string line; std::getline(file, line);)
		{
			auto& pose = poses.emplace_back();
			EXPECT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lfdeg", &pose[0], &pose[1], &pose[2]), 3) << line;
		}
		return poses;
	}

	/// Expects all frames of trajectory.txt but two to be there, each at one of `truth`, in their order.
	static void expect_trajectory(const std::string& localized, const std::vector<mrpt::math::TPose2D>& truth)
	{
		std::ifstream file(localized + "/trajectory.txt");
		std::size_t poses = 0, next = 0;
		double time = 0;
		for (mrpt::math::TPose2D pose; file >> time >> pose.x >> pose.y >> pose.phi; poses++, next++)
		{
			const auto off = [&] { return std::hypot(pose.x - truth[next].x, pose.y - truth[next].y); };
			while (next < truth.size() && off() > 0.2) next++;
			ASSERT_LT(next, truth.size()) << "pose " << poses << " is none of those to come";
			EXPECT_NEAR(pose.phi, truth[next].phi, 0.05) << "pose " << poses;
		}
		EXPECT_GE(poses + 2, truth.size());
	}

   private:
	std::string folder_ =
	    testing::TempDir() + "d2s1r_example_" + testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(Examples, LocalizeThenTrackConvergesFromTheFirstStep)
{
	run("localize_then_track.sh " + path("out"));
	const auto poses = pf_poses(path("out"));
	ASSERT_GE(poses.size(), 25U);
	// the one-shot poses are the reference
	std::ifstream file(path("out/localized/trajectory.txt"));
	double time = 0, x = 0, y = 0, phi = 0;
	std::size_t i = 0;
	for (; file >> time >> x >> y >> phi; i++)
	{
		ASSERT_LT(i, poses.size());
		EXPECT_LT(std::hypot(poses[i][0] - x, poses[i][1] - y), 0.5) << "step " << i;
		EXPECT_LT(std::abs(std::remainder(poses[i][2] - phi * 180 / M_PI, 360)), 10) << "step " << i;
	}
	EXPECT_EQ(poses.size(), i);
}

TEST_F(Examples, TrackWithSignatureMapArrives)
{
	run("track_with_signature_map.sh " + path("out") + " " D2S1R_MODULE);
	const auto poses = pf_poses(path("out"));
	ASSERT_EQ(poses.size(), 37U);
	EXPECT_NEAR(poses.back()[0], 15.91, 0.3);
	EXPECT_NEAR(poses.back()[1], -10.01, 0.3);
	EXPECT_NEAR(poses.back()[2], 4.95, 5.0);
}

TEST_F(Examples, TrackWithSignatureMapRefusesAModuleWithoutTheMap)
{
	std::ofstream(path("other.so")) << "no module";  // the loader leaves it out, and pf-localization runs without a map
	const auto result = run_command(
	    "RAWLOG_LOCALIZE=" RAWLOG_LOCALIZE " " + kExamples + "track_with_signature_map.sh " + path("out") + " " +
	    path("other.so"));
	EXPECT_EQ(result.status, 1);
	EXPECT_EQ(result.output, path("other.so") + ": brings no CSignatureMap2D; name libd2s1r-pf-init.so\n");
}

void save_flat(const std::string& file)
{
	mrpt::io::CFileGZOutputStream stream(file);
	mrpt::serialization::archiveFrom(stream) << *d2s1r::test::make_mrpt_map(kFlat);
}

TEST_F(Examples, SimulateThenLocalizeFindsTheSimulatedPath)
{
	save_flat(path("flat.gridmap.gz"));
	{
		std::ofstream poses(path("poses.txt"));
		for (const auto& pose : flat_path())
			poses << 1000000000 + 10 * pose.x << ' ' << pose.x << ' ' << pose.y << ' ' << pose.phi << '\n';
	}
	run("simulate_then_localize.sh " + path("out") + " " + path("flat.gridmap.gz") + " " + path("poses.txt"));
	expect_trajectory(path("out/localized"), flat_path());
	EXPECT_TRUE(std::filesystem::exists(path("out/localized/fused.csv")));
}

/// The flat as a map of map_server: dark is occupied.
void write_ros_map(const std::string& stem)
{
	std::ofstream image(stem + ".pgm");
	image << "P2\n" << kFlat.width << ' ' << kFlat.height << "\n255\n";
	for (int y = kFlat.height - 1; y >= 0; y--)
		for (int x = 0; x < kFlat.width; x++) image << (kFlat.at(x, y) == d2s1r::Cell::kOccupied ? 0 : 254) << '\n';
	std::ofstream(stem + ".yaml") << "image: " << std::filesystem::path(stem).filename().string()
	                              << ".pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
	                                 "occupied_thresh: 0.65\nfree_thresh: 0.196\n";
}

/// FLASER: 180 ranges, 1 deg apart, laser pose, odometry, time, host, time.
void write_carmen_log(const std::string& file)
{
	d2s1r::test::Laser laser;
	laser.beams = 180;
	laser.aperture = 179 * M_PI / 180;
	std::ofstream log(file);
	int i = 0;
	for (const auto& pose : flat_path())
	{
		const auto scan = d2s1r::test::make_mrpt_observation(kFlat, pose, laser);
		log << "FLASER 180";
		for (std::size_t b = 0; b < scan.getScanSize(); b++) log << ' ' << scan.getScanRange(b);
		for (int copy = 0; copy < 2; copy++) log << ' ' << pose.x << ' ' << pose.y << ' ' << pose.phi;
		log << ' ' << 100 + i << " nohost " << 100 + i << '\n';
		i++;
	}
}

/// rawlog-grabber records a laser that is none, through its driver of a real one.
TEST_F(Examples, FollowRawlogGrabberLocalizesWhileItRecords)
{
	save_flat(path("flat.gridmap.gz"));
	const mrpt::math::TPose2D robot(2.5, 1.9, 0.4);
	d2s1r::test::Laser laser;
	laser.beams = 811;
	laser.aperture = 1.5 * M_PI;
	laser.max_range = 10;
	laser.clockwise = true;  // as the driver takes it
	const d2s1r::test::FakeLaser fake(d2s1r::test::make_mrpt_observation(kFlat, robot, laser));
	std::ofstream(path("laser.ini")) << "[global]\ntime_between_launches = 1\n[LASER]\ndriver = CSICKTim561Eth\n"
	                                    "process_rate = 50\nsensorLabel = LASER\nip_address = 127.0.0.1\nTCP_port = "
	                                 << fake.port() << '\n';
	constexpr int kLines = 5;  // the example ends when nobody reads its lines any more
	const auto result = run_command(
	    "RAWLOG_LOCALIZE=" RAWLOG_LOCALIZE " " + kExamples + "follow_rawlog_grabber.sh " + path("out") + " " +
	    path("flat.gridmap.gz") + " " + path("laser.ini") + " 2> /dev/null | head -n " + std::to_string(kLines));
	std::istringstream lines(result.output);
	int count = 0, localized = 0;
	for (std::string line; std::getline(lines, line); count++)
	{
		const auto json = nlohmann::json::parse(line);
		if (json["status"] != "localized") continue;  // the driver gives a scan without beams if the laser is late
		localized++;
		EXPECT_NEAR(json["x"].get<double>(), robot.x, 0.05);
		EXPECT_NEAR(json["y"].get<double>(), robot.y, 0.05);
		EXPECT_NEAR(json["phi"].get<double>(), robot.phi, 0.02);
	}
	const std::string grabber_said = run_command("cat " + path("out/grabber.log")).output;
	if (count < kLines && grabber_said.find("Exception in SensorThread") != std::string::npos)
		GTEST_SKIP() << "the driver gave the laser up, which it does after 40 ms: the machine does too much else";
	EXPECT_EQ(count, kLines) << grabber_said;
	EXPECT_GT(localized, 0);
}

TEST_F(Examples, CarmenLogInRosMapFindsThePath)
{
	write_ros_map(path("flat"));
	write_carmen_log(path("walk.log"));
	run("carmen_log_in_ros_map.sh " + path("out") + " " + path("flat.yaml") + " " + path("walk.log"));
	expect_trajectory(path("out/localized"), flat_path());
}
}  // namespace
