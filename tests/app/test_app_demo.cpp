// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// MRPT's own demo data, and the sites in D2S1R_DATA: what the program says is so.
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "app_process.h"

using namespace d2s1r::test;
namespace fs = std::filesystem;

class AppDemo : public AppTest
{
};

class AppData : public AppTest
{
   protected:
	/// Folder of the sites.
	static fs::path data()
	{
		const char* set = std::getenv("D2S1R_DATA");
		return set ? fs::path(set) : fs::path(D2S1R_SOURCE_DIR) / "../shared/data";
	}
};

TEST_F(AppDemo, LocalizationDemoIsLocalizedFromItsFirstScanToItsLast)
{
	const fs::path datasets = "/usr/share/mrpt/datasets";
	if (!fs::exists(datasets / "localization_demo.rawlog")) GTEST_SKIP() << "no demo data: install mrpt-common";
	const auto result = run(
	    {"-m", datasets / "localization_demo.simplemap.gz", "-i", datasets / "localization_demo.rawlog", "-o",
	     path("out")});
	ASSERT_EQ(result.status, 0) << result.err;
	const CsvTable frames(path("out/frames.csv"), kFramesHeader);
	ASSERT_EQ(frames.size(), 37U);
	int localized = 0;
	for (std::size_t i = 0; i < frames.size(); i++) localized += frames.text(i, "status") == "localized";
	EXPECT_GE(localized, 33);
	// Where MRPT's particle filter ends with 40,000 particles.
	EXPECT_LT(std::hypot(frames.number(36, "x") - 15.91, frames.number(36, "y") + 10.01), 0.3);
	EXPECT_LT(std::abs(frames.number(36, "phi") * 180 / M_PI - 4.95), 5);
}

/// README shows the bag; the rawlog holds the same drive.
TEST_F(AppDemo, TheOfficeThatShipsIsLocalizedAsABagAndAsARawlog)
{
	const fs::path office = D2S1R_SOURCE_DIR "/share/d2s1r/data";
	for (const char* log : {"office_bag", "office.rawlog"})
	{
		SCOPED_TRACE(log);
		const auto result = run({"-m", office / "office.yaml", "-i", office / log, "-o", path("out")});
		ASSERT_EQ(result.status, 0) << result.err;
		const CsvTable frames(path("out/frames.csv"), kFramesHeader);
		std::istringstream truth(read_file(office / "office_truth.txt"));
		double time = 0, x = 0, y = 0, phi = 0;
		for (std::size_t i = 0; i < frames.size(); i++)
		{
			ASSERT_TRUE(truth >> time >> x >> y >> phi) << "frame " << i;
			ASSERT_EQ(frames.text(i, "status"), "localized") << "frame " << i;
			EXPECT_NEAR(frames.number(i, "timestamp"), time, 1e-3) << "frame " << i;
			EXPECT_LT(std::hypot(frames.number(i, "x") - x, frames.number(i, "y") - y), 0.05) << "frame " << i;
			EXPECT_LT(std::abs(std::remainder(frames.number(i, "phi") - phi, 2 * M_PI)), 0.02) << "frame " << i;
		}
		EXPECT_FALSE(truth >> time) << "the log lacks frames";
	}
}

TEST_F(AppData, TableCountsAsTheEvaluationScriptDoes)
{
	const fs::path site = data() / "intel", script = data() / "../tools/evaluate.py";
	if (!fs::exists(site / "test.rawlog") || !fs::exists(script)) GTEST_SKIP() << "no data: set D2S1R_DATA";
	constexpr std::size_t kFrames = 80;
	const auto lines = lines_of(read_file(site / "test_gt.txt"));
	std::string truth;
	for (std::size_t i = 0; i < kFrames + 1; i++) truth += lines.at(i) + "\n";  // the first one is a comment
	write_file(path("truth.txt"), truth);
	const auto result = run(
	    {"-m", site / "map_test.yaml", "-i", site / "test.rawlog", "-o", path("out"), "--frames",
	     "0:" + std::to_string(kFrames), "--ground-truth", path("truth.txt")});
	ASSERT_EQ(result.status, 0) << result.err;
	const auto scores = run_program({"python3", script, path("out/frames.csv"), path("truth.txt")});
	if (scores.status == 127) GTEST_SKIP() << "python3 is missing";
	ASSERT_EQ(scores.status, 0) << scores.err;
	unsigned successes = 0, frames = 0;
	double position = 0, position_deviation = 0, yaw = 0, yaw_deviation = 0;
	const auto table = [&](const char* start) { return result.out.substr(result.out.find(start)); };
	ASSERT_EQ(std::sscanf(table("0.3 m, 5 deg").c_str(), "0.3 m, 5 deg: %u of %u", &successes, &frames), 2)
	    << result.out;
	ASSERT_EQ(
	    std::sscanf(
	        table("error").c_str(), "error %lf m +- %lf m, %lf deg +- %lf deg", &position, &position_deviation, &yaw,
	        &yaw_deviation),
	    4)
	    << result.out;
	EXPECT_EQ(frames, kFrames);
	const auto score = [&](const char* name, int index)
	{
		double values[2] = {NAN, NAN};
		const std::string line = scores.out.substr(scores.out.find(name));
		std::sscanf(line.c_str() + line.find_first_of("0123456789"), "%lf, %lf", &values[0], &values[1]);
		return values[index];
	};
	EXPECT_NEAR(score("success", 0), 1.0 * successes / kFrames, 1e-4);
	EXPECT_NEAR(score("position_error_m", 0), position, 6e-4);
	EXPECT_NEAR(score("position_error_m", 1), position_deviation, 6e-4);
	EXPECT_NEAR(score("yaw_error_deg", 0), yaw, 6e-3);
	EXPECT_NEAR(score("yaw_error_deg", 1), yaw_deviation, 6e-3);
}
