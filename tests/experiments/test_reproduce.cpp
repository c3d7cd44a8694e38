// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// experiments/reproduce.py on two small sites.
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;
namespace fs = std::filesystem;

class Reproduce : public AppTest
{
   protected:
	static constexpr const char* kPython = "/usr/bin/python3";  // the one that Debian's packages are for
	static constexpr const char* kAlterScans = D2S1R_BUILD_DIR "/experiments/alter_scans";

	/// The flat as a map_server map, and sets of scans of the walk.
	void write_site(const std::string& name, const Words& sets) const
	{
		const fs::path site = folder() / "data" / name;
		fs::create_directories(site);
		for (const char* map : {"map.yaml", "map_test.yaml"}) save_map(flat(), site / map);
		for (const std::string& set : sets)
		{
			save(observation_log(), (site / (set + ".rawlog")).string());
			save_truth((site / (set + "_gt.txt")).string(), false);
		}
	}

	/// Says of the first \p count scans of a site's test set that their places are in the map, and of the others that
	/// they are not.
	void write_knowledge(const std::string& name, int count) const
	{
		std::istringstream truth(read_file(path("data/" + name + "/test_gt.txt")));
		std::string known = "timestamp,on_walls,doubtful\n";
		for (std::string line; std::getline(truth, line);)
			if (line.find_first_of("%#") != 0)
				known += line.substr(0, line.find(' ')) + (count-- > 0 ? ",0.9,0\n" : ",0.1,0\n");
		write_file(path("data/" + name + "/test_scans.csv"), known);
	}

	/// The second of three scans of a walk, as alter_scans makes it; null if it does not.
	/// \param how NAME=VALUE words
	mrpt::obs::CObservation2DRangeScan::Ptr altered(const Words& how) const
	{
		save(observation_log(), path("in.rawlog"));
		Words words = {kAlterScans, path("in.rawlog"), path("out.rawlog"), "frames=3"};
		words.insert(words.end(), how.begin(), how.end());
		EXPECT_EQ(run_program(words).status, 0);
		const Objects scans = load(path("out.rawlog"));
		EXPECT_EQ(scans.size(), 3U);
		return scans.size() == 3 ? std::dynamic_pointer_cast<mrpt::obs::CObservation2DRangeScan>(scans[1]) : nullptr;
	}

	ProcessResult reproduce(const Words& more = {}) const
	{
		Words words = {kPython,    std::string(D2S1R_SOURCE_DIR) + "/experiments/reproduce.py",
		               "--build",  D2S1R_BUILD_DIR,
		               "--data",   path("data"),
		               "--output", path("results"),
		               "--store",  path("store")};
		words.insert(words.end(), more.begin(), more.end());
		return run_program(words);
	}

	/// Copies the library and the programs of learn.py and of a job to folder()/build.
	void copy_build() const
	{
		const fs::path libraries = "libs/d2s1r";
		fs::create_directories(folder() / "build" / libraries);
		for (const auto& entry : fs::directory_iterator(D2S1R_BUILD_DIR / libraries))
			if (entry.path().filename().string().rfind("libd2s1r.so", 0) == 0)
				fs::copy(
				    entry.path(), folder() / "build" / libraries / entry.path().filename(),
				    fs::copy_options::copy_symlinks);
		for (const fs::path program :
		     {"experiments/alter_scans", "experiments/simulate_floor", "experiments/write_terms",
		      "apps/rawlog-localize/rawlog-localize"})
		{
			fs::create_directories((folder() / "build" / program).parent_path());
			fs::copy_file(D2S1R_BUILD_DIR / program, folder() / "build" / program);
		}
	}

	/// What results of folder()/build are kept by.
	struct Keys
	{
		std::string reproduced, learned, made;
	};

	Keys keys() const
	{
		const std::string script = R"(
import pathlib, sys
sys.dont_write_bytecode = True
sys.path.insert(0, sys.argv[1])
import plan, runs, sites
from learning import running
folder = pathlib.Path(sys.argv[2])
job = plan.Job(sites.find(folder / "data")[0], "test", "default", 1)
runner = runs.Runner(folder / "build", folder, folder, folder)
runner.look_at_programs([job])
learner = running.Runner(folder / "build", folder, 1)
print(runner.key(job), learner.digest, learner.folder)
)";
		const ProcessResult told = run_program(
		    {"env", "LD_LIBRARY_PATH=" + path("build/libs/d2s1r"), kPython, "-c", script,
		     D2S1R_SOURCE_DIR "/experiments", folder().string()});
		EXPECT_EQ(told.status, 0) << told.err;
		Keys result;
		std::istringstream(told.out) >> result.reproduced >> result.learned >> result.made;
		return result;
	}
};

TEST_F(Reproduce, WritesTablesAndFigures)
{
	if (run_program({kPython, "-c", "import matplotlib, scipy"}).status != 0)
		GTEST_SKIP() << "NO MATPLOTLIB: install Debian's python3-matplotlib and python3-scipy";
	write_site("intel", {"sim360_on", "sim360_off", "test", "run"});
	write_site("mit_killian", {"test", "run"});
	write_knowledge("mit_killian", 3);
	write_site("olin_mac_923", {"test"});
	const ProcessResult result = reproduce({"--frames", "12", "--sweep-frames", "6", "--drives", "1"});
	ASSERT_EQ(result.status, 0) << result.err;
	const std::string report = read_file(path("results/README.md"));
	for (const char* part :
	     {"## The paper's experiments",
	      "## Time per scan (Table III)",
	      "## Success (Table IV)",
	      "## Precision (Table V)",
	      "## Where scans were localized (Figs. 3 and 4)",
	      "## Real full circles (D_T",
	      "## Convergence of the particle filter (Fig. 7",
	      "## Corridors: each scan alone and fused (Fig. 8",
	      "## Reliability",
	      "## Right poses by confidence",
	      "## Scans of another site",
	      "## Field of view",
	      "## A narrow sensor that turns in place",
	      "## Clutter",
	      "## Reach",
	      "## 10 scans together",
	      "## Rays",
	      "| Its rivals, Tables III and IV | [comparison](comparison/README.md) |",
	      "answers ",
	      "[Success (Table IV)](#success-table-iv)",
	      "| intel sim360_on (D_I0) | 99 | 98 | 97 | **100.0 (54-100)** | **100.0 (54-100)** |",
	      "| mit_killian | test | 12 | **100.0 (54-100)** | **100.0 (54-100)** |",
	      "| olin_mac_923 | 12 | - | **100.0 (54-100)** | **100.0 (54-100)** | 100.0 (54-100) | 100.0 (54-100) |",
	      "| mit_killian test | 100.0 (23-100) |",
	      "## A narrow sensor that turns in place (Section III-C)",
	      "whose place is in the map of their own site: 28 of 28, 100.0 (69.0-100.0).",
	      "| intel | 12 | 100.0 (51.6-100.0) | 100.0 (37-100) of mit_killian |"})
		EXPECT_NE(report.find(part), std::string::npos) << part << " is not in\n" << report;
	for (const char* figure : {"errors", "success_maps", "reliability", "field_of_view", "clutter"})
	{
		const fs::path file = path("results/" + std::string(figure) + ".png");
		ASSERT_TRUE(fs::exists(file)) << file;
		EXPECT_EQ(read_file(file).substr(1, 3), "PNG");
		EXPECT_NE(report.find("](" + file.filename().string() + ")"), std::string::npos) << file;
	}
}

TEST_F(Reproduce, GoesOnWhereItStoppedAndLeavesOutTheMapsIfAskedTo)
{
	if (run_program({kPython, "-c", "import matplotlib, scipy"}).status != 0)
		GTEST_SKIP() << "NO MATPLOTLIB: install Debian's python3-matplotlib and python3-scipy";
	write_site("flat", {"sim360_off"});
	const auto run_and_list = [&]
	{
		const ProcessResult result = reproduce({"--frames", "2", "--sweep-frames", "1", "--drives", "0", "--no-maps"});
		EXPECT_EQ(result.status, 0) << result.err;
		std::map<fs::path, fs::file_time_type> kept;
		for (const auto& entry : fs::directory_iterator(path("store"))) kept[entry.path()] = entry.last_write_time();
		return kept;
	};
	const auto first = run_and_list();
	EXPECT_GT(first.size(), 5U);
	EXPECT_FALSE(fs::exists(path("results/success_maps.png")));
	const std::string report = read_file(path("results/README.md"));
	EXPECT_EQ(report.find("success_maps.png"), std::string::npos) << report;
	EXPECT_NE(report.find("--drives 0 --no-maps`"), std::string::npos) << report;
	const auto [missing, when] = *first.begin();
	fs::remove(missing);
	auto again = run_and_list();
	ASSERT_EQ(again.count(missing), 1U) << "what was missing was run";
	EXPECT_GT(again[missing], when);
	again[missing] = when;
	EXPECT_EQ(again, first) << "and nothing else";
}

TEST_F(Reproduce, ResultsOfOtherProgramsLibrariesAndDataAreNotUsedAgain)
{
	if (run_program({kPython, "-c", "import matplotlib, scipy, PIL"}).status != 0)
		GTEST_SKIP() << "NO MATPLOTLIB: install Debian's python3-matplotlib, python3-scipy and python3-pil";
	write_site("flat", {"test"});
	copy_build();
	const Keys before = keys(), same = keys();
	EXPECT_EQ(same.reproduced, before.reproduced);
	EXPECT_EQ(same.learned, before.learned);
	EXPECT_EQ(same.made, before.made);
	std::ofstream(fs::canonical(folder() / "build/libs/d2s1r/libd2s1r.so"), std::ios::app) << "changed";
	const Keys other = keys();
	EXPECT_NE(other.reproduced, before.reproduced);
	EXPECT_NE(other.learned, before.learned);
	EXPECT_NE(other.made, before.made) << "programs that make data read logs, for which they load the library";
	std::ofstream(folder() / "build/experiments/alter_scans", std::ios::app) << "changed";
	const Keys altered = keys();
	EXPECT_NE(altered.made, before.made);
	EXPECT_NE(altered.reproduced, other.reproduced);
	write_file(path("data/flat/other.txt"), "other data");
	EXPECT_NE(keys().reproduced, altered.reproduced);
}

TEST_F(Reproduce, SaysWhatIsMissing)
{
	if (run_program({kPython, "-c", "import matplotlib, scipy"}).status != 0)
		GTEST_SKIP() << "NO MATPLOTLIB: install Debian's python3-matplotlib and python3-scipy";
	fs::create_directories(folder() / "data");
	const ProcessResult nothing = reproduce();
	EXPECT_EQ(nothing.status, 1);
	EXPECT_NE(nothing.err.find("no site with a map.yaml"), std::string::npos) << nothing.err;
	write_site("flat", {"test"});
	const ProcessResult unbuilt = reproduce({"--build", path("no-build")});
	EXPECT_EQ(unbuilt.status, 1);
	EXPECT_NE(unbuilt.err.find("is missing; build the project"), std::string::npos) << unbuilt.err;
	const ProcessResult idle = reproduce({"--jobs", "0"});
	EXPECT_EQ(idle.status, 2);
	EXPECT_NE(idle.err.find("--jobs: invalid whole_number value: '0'"), std::string::npos) << idle.err;
}

TEST_F(Reproduce, NarrowerAndBlockedScansAreMadeAsAskedFor)
{
	const auto scan = altered({"field_of_view=90", "blocked=0.5"});
	ASSERT_TRUE(scan);
	const auto original = walk_scan(4);
	EXPECT_EQ(scan->timestamp, original->timestamp);
	ASSERT_NEAR(static_cast<double>(scan->getScanSize()), 90, 1);
	EXPECT_NEAR(static_cast<double>(scan->aperture), static_cast<double>(scan->getScanSize() - 1) * M_PI / 180, 1e-3);
	const std::size_t first = (original->getScanSize() - scan->getScanSize()) / 2;
	int blocked = 0;
	for (std::size_t beam = 0; beam < scan->getScanSize(); beam++)
	{
		const float was = original->getScanRange(first + beam);
		blocked += scan->getScanRange(beam) != was ? 1 : 0;
		EXPECT_LE(scan->getScanRange(beam), was);
	}
	EXPECT_GT(blocked, 10);
	EXPECT_EQ(run_program({kAlterScans, path("no.rawlog"), path("out.rawlog")}).status, 1);
}

TEST_F(Reproduce, BeamsEndBeforeTheWallOrAreInTheWrongOrder)
{
	const auto spoiled = altered({"short=0.5"}), mirrored = altered({"mirrored=1"});
	ASSERT_TRUE(spoiled && mirrored);
	const auto original = walk_scan(4);
	const std::size_t beams = original->getScanSize();
	ASSERT_EQ(spoiled->getScanSize(), beams);
	ASSERT_EQ(mirrored->getScanSize(), beams);
	int returns = 0, ended = 0;
	for (std::size_t beam = 0; beam < beams; beam++)
	{
		EXPECT_EQ(mirrored->getScanRange(beam), original->getScanRange(beams - 1 - beam)) << beam;
		EXPECT_EQ(mirrored->getScanRangeValidity(beam), original->getScanRangeValidity(beams - 1 - beam)) << beam;
		EXPECT_EQ(spoiled->getScanRangeValidity(beam), original->getScanRangeValidity(beam)) << beam;
		if (!original->getScanRangeValidity(beam)) continue;
		returns++;
		if (spoiled->getScanRange(beam) == original->getScanRange(beam)) continue;
		ended++;
		EXPECT_GE(spoiled->getScanRange(beam), 0.2F) << beam;
		EXPECT_LT(spoiled->getScanRange(beam), original->getScanRange(beam)) << beam;
	}
	EXPECT_NEAR(static_cast<double>(ended) / returns, 0.5, 0.12);
}

TEST_F(Reproduce, ScansOfShortReachSayNothingBeyondIt)
{
	const auto scan = altered({"reach=2.5"});
	ASSERT_TRUE(scan);
	const auto original = walk_scan(4);
	EXPECT_EQ(scan->maxRange, 2.5F);
	ASSERT_EQ(scan->getScanSize(), original->getScanSize());
	int beyond = 0;
	for (std::size_t beam = 0; beam < scan->getScanSize(); beam++)
	{
		const bool is_beyond = original->getScanRange(beam) >= 2.5F;
		EXPECT_EQ(scan->getScanRangeValidity(beam), original->getScanRangeValidity(beam) && !is_beyond) << beam;
		EXPECT_EQ(scan->getScanRange(beam), std::min(2.5F, original->getScanRange(beam))) << beam;
		beyond += is_beyond ? 1 : 0;
	}
	EXPECT_GT(beyond, 10);
}

TEST_F(Reproduce, ThinnedScansShowTheSameFromWhereTheyLook)
{
	const auto scan = altered({"beams=90"});
	ASSERT_TRUE(scan);
	const auto original = walk_scan(4);
	EXPECT_LE(scan->getScanSize(), 90U);
	EXPECT_GT(scan->getScanSize(), 45U);
	const auto direction = [](const auto& of, std::size_t beam)
	{
		const double step = static_cast<double>(of.aperture) / static_cast<double>(of.getScanSize() - 1);
		return of.sensorPose.yaw() - static_cast<double>(of.aperture) / 2 + static_cast<double>(beam) * step;
	};
	const std::size_t stride = (original->getScanSize() + scan->getScanSize() - 1) / scan->getScanSize();
	for (std::size_t beam = 0; beam < scan->getScanSize(); beam++)
	{
		EXPECT_EQ(scan->getScanRange(beam), original->getScanRange(stride * beam)) << beam;
		EXPECT_NEAR(direction(*scan, beam), direction(*original, stride * beam), 1e-5) << beam;
	}
}

TEST_F(Reproduce, CirclesOfATurningRobotShowWhatAWideLaserSees)
{
	write_site("flat", {"test"});
	const std::string map = path("data/flat/map.yaml"), truth = path("data/flat/test_gt.txt");
	const std::string program = D2S1R_BUILD_DIR "/experiments/simulate_circles";
	const auto simulated = [&](const std::string& field_of_view, const std::string& slip)
	{
		const Words words = {program, map, truth, path("circles.rawlog"), "frames=2", "noise=0", field_of_view, slip};
		EXPECT_EQ(run_program(words).status, 0);
		return std::dynamic_pointer_cast<mrpt::obs::CObservation2DRangeScan>(load(path("circles.rawlog")).at(1));
	};
	const auto wide = simulated("field_of_view=360", "slip=0");
	const auto turned = simulated("field_of_view=90", "slip=0");
	const auto slipped = simulated("field_of_view=90", "slip=0.2");
	ASSERT_TRUE(wide && turned && slipped);
	int same = 0, off = 0;
	for (std::size_t beam = 0; beam < 360; beam++)
	{
		same += std::abs(turned->getScanRange(beam) - wide->getScanRange(beam)) < 0.1F ? 1 : 0;
		off += std::abs(slipped->getScanRange(beam) - wide->getScanRange(beam)) > 0.1F ? 1 : 0;
	}
	EXPECT_GT(same, 280);  // the laser is 0.1 m ahead of what the robot turns about
	EXPECT_GT(off, 360 - same);
	EXPECT_EQ(turned->timestamp, wide->timestamp);
	EXPECT_EQ(run_program({program, map, truth, path("out.rawlog"), "slipp=3"}).status, 1);
}

TEST_F(Reproduce, PlainLoopsTakeRangesOfZeroForNoReturns)
{
	write_site("flat", {"test"});
	const std::string map = path("data/flat/map.yaml"), programs = D2S1R_BUILD_DIR "/experiments/";
	const Words circles = {
	    programs + "simulate_circles", map, path("data/flat/test_gt.txt"), path("circles.rawlog"), "frames=3"};
	ASSERT_EQ(run_program(circles).status, 0);
	Objects scans = load(path("circles.rawlog"));
	for (auto& object : scans)
	{
		auto& scan = dynamic_cast<mrpt::obs::CObservation2DRangeScan&>(*object);
		for (std::size_t beam = 100; beam < 103; beam++)
		{
			scan.setScanRange(beam, 0);
			scan.setScanRangeValidity(beam, false);
		}
	}
	save(scans, path("circles.rawlog"));
	const auto answers = [&](const std::string& method)
	{
		const ProcessResult told = run_program(
		    {programs + "rivals", method, map, path("circles.rawlog"), path(method + ".csv"),
		     "config=" D2S1R_SOURCE_DIR "/share/d2s1r/config/paper.ini"});
		EXPECT_EQ(told.status, 0) << told.err;
		return CsvTable(path(method + ".csv"), "frame,timestamp,status,x,y,phi,confidence,total_ms");
	};
	const CsvTable loops = answers("literal"), library = answers("d2s1r");
	ASSERT_EQ(loops.size(), 3U);
	ASSERT_EQ(library.size(), 3U);
	for (std::size_t i = 0; i < 3; i++)
	{
		ASSERT_EQ(loops.text(i, "status"), "localized") << i;
		for (const char* column : {"x", "y", "phi"})
			EXPECT_NEAR(loops.number(i, column), library.number(i, column), 1e-3) << column << " of scan " << i;
	}
}

TEST_F(Reproduce, NoiseAndMissingBeamsAreAsManyAsAskedFor)
{
	const auto noisy = altered({"relative_noise=0.02"}), sparse = altered({"invalid=0.4"});
	ASSERT_TRUE(noisy && sparse);
	const auto original = walk_scan(4);
	double squares = 0;
	int returns = 0, missing = 0;
	for (std::size_t beam = 0; beam < original->getScanSize(); beam++)
	{
		if (!original->getScanRangeValidity(beam)) continue;
		const double error = static_cast<double>(noisy->getScanRange(beam) / original->getScanRange(beam)) - 1;
		squares += error * error;
		returns++;
		missing += sparse->getScanRangeValidity(beam) ? 0 : 1;
	}
	EXPECT_NEAR(std::sqrt(squares / returns), 0.02, 0.004);
	EXPECT_NEAR(static_cast<double>(missing) / returns, 0.4, 0.15);
	EXPECT_EQ(altered({"invalid=0.4", "seed=0"})->getScanRange(7), sparse->getScanRange(7));
	EXPECT_EQ(run_program({kAlterScans, path("in.rawlog"), path("out.rawlog"), "reech=3"}).status, 1);
}
