// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The drawn floors and degraded maps of experiments/learning.
#include <d2s1r/grid.h>
#include <d2s1r/map_io.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numeric>
#include <sstream>

#include "experiment_scripts.h"

using namespace d2s1r::test;
namespace fs = std::filesystem;

class LearningData : public ExperimentScripts
{
   protected:
	static constexpr const char* kSimulateFloor = D2S1R_BUILD_DIR "/experiments/simulate_floor";

	LearningData() : ExperimentScripts("numpy, scipy, PIL") {}

	static std::string script(const std::string& name)
	{
		return std::string(D2S1R_SOURCE_DIR) + "/experiments/learning/" + name;
	}

	/// Draws a site into path(folder).
	void draw(
	    const std::string& kind, const std::string& area, const std::string& seed, const std::string& folder) const
	{
		const ProcessResult drawn = run_program(
		    {kPython, script("drawn_sites.py"), kind, area, seed, path(folder), "--scans", "30", "--simulate-floor",
		     kSimulateFloor});
		ASSERT_EQ(drawn.status, 0) << drawn.err;
	}

	/// Degrades the map of path("site") into path(folder).
	void degrade(const Words& how, const std::string& folder) const
	{
		Words words{kPython,      script("degraded_maps.py"), path("site/map.yaml"),
		            path(folder), "--ground-truth",           path("site/scans_gt.txt")};
		words.insert(words.end(), how.begin(), how.end());
		const ProcessResult degraded = run_program(words);
		ASSERT_EQ(degraded.status, 0) << degraded.err;
	}

	d2s1r::Grid grid(const std::string& folder) const
	{
		return d2s1r::make_grid(*d2s1r::load_map(path(folder + "/map.yaml")), {});
	}

	/// Positions of a ground truth [m].
	std::vector<std::array<double, 2>> positions(const std::string& file) const
	{
		std::ifstream stream(path(file));
		std::vector<std::array<double, 2>> result;
		for (double time = 0, x = 0, y = 0, phi = 0; stream >> time >> x >> y >> phi;) result.push_back({x, y});
		return result;
	}

	/// How far the poses of the scans of path("site"), localized in path(folder), are from `truth` [m], 0.3 m each at
	/// most.
	std::vector<double> errors(
	    const std::string& map, const std::string& scans, const std::string& truth, const Words& more = {}) const
	{
		Words words{"-q", "-m", path(map), "-i", path(scans), "-o", path("out")};
		words.insert(words.end(), more.begin(), more.end());
		const ProcessResult localized = run(words);
		EXPECT_EQ(localized.status, 0) << localized.err;
		const CsvTable frames(path("out/frames.csv"), kFramesHeader);
		const auto at = positions(truth);
		EXPECT_EQ(frames.size(), at.size());
		std::vector<double> result;
		for (std::size_t i = 0; i < frames.size(); i++)
			result.push_back(
			    frames.text(i, "x").empty()
			        ? 0.3
			        : std::min(0.3, std::hypot(frames.number(i, "x") - at[i][0], frames.number(i, "y") - at[i][1])));
		return result;
	}

	/// [m2]
	double area(const std::string& folder, d2s1r::Cell kind) const
	{
		const d2s1r::Grid map = grid(folder);
		return static_cast<double>(std::count(map.cells.begin(), map.cells.end(), kind)) * map.cell_size *
		       map.cell_size;
	}
};

TEST_F(LearningData, FloorsAreTheSameForASeedAndOthersForAnother)
{
	draw("office", "250", "7", "site");
	draw("office", "250", "7", "again");
	draw("office", "250", "8", "other");
	for (const char* file : {"map.png", "map.yaml", "scans.rawlog", "scans_gt.txt"})
	{
		const std::string content = read_file(folder() / "site" / file);
		EXPECT_GT(content.size(), 50U) << file;
		EXPECT_EQ(content, read_file(folder() / "again" / file)) << file;
		EXPECT_NE(content, read_file(folder() / "other" / file)) << file;
	}
}

TEST_F(LearningData, FloorsOfAllKindsHaveMapsAndScansThatFit)
{
	for (const char* kind : {"office", "corridor", "hall", "apartment", "warehouse"})
	{
		draw(kind, "400", "3", kind);
		const double free = area(kind, d2s1r::Cell::kFree);
		EXPECT_GT(free, 60) << kind;
		EXPECT_LT(free, 800) << kind;
		EXPECT_GT(area(kind, d2s1r::Cell::kUnknown), 0.1 * free) << kind;
		const std::string site = kind;
		const auto off = errors(site + "/map.yaml", site + "/scans.rawlog", site + "/scans_gt.txt");
		const auto right = std::count_if(off.begin(), off.end(), [](double error) { return error < 0.1; });
		EXPECT_GE(right, 25) << kind;
	}
}

TEST_F(LearningData, MapsAreDegradedAsAskedFor)
{
	draw("office", "250", "7", "site");
	const double walls = area("site", d2s1r::Cell::kOccupied), free = area("site", d2s1r::Cell::kFree);
	degrade({"smeared=0.2", "--seed", "5"}, "smeared");
	degrade({"smeared=0.2", "--seed", "5"}, "again");
	EXPECT_EQ(read_file(path("smeared/map.png")), read_file(path("again/map.png")));
	EXPECT_EQ(read_file(path("smeared/gt.txt")), read_file(path("again/gt.txt")));
	EXPECT_GT(area("smeared", d2s1r::Cell::kOccupied), 3 * walls);
	degrade({"smeared=0.2,0.5"}, "behind");
	EXPECT_GT(area("behind", d2s1r::Cell::kOccupied), 1.15 * area("smeared", d2s1r::Cell::kOccupied));
	EXPECT_NEAR(area("behind", d2s1r::Cell::kFree), area("smeared", d2s1r::Cell::kFree), 0.05 * free);
	degrade({"coarse=0.1"}, "coarse");
	EXPECT_NEAR(grid("coarse").cell_size, 0.1, 1e-6);
	EXPECT_NEAR(area("coarse", d2s1r::Cell::kFree), free, 0.2 * free);
	degrade({"grey=0.3"}, "grey");
	EXPECT_NEAR(area("grey", d2s1r::Cell::kFree), 0.7 * free, 0.05 * free);
	degrade({"false_free=1"}, "leaky");
	EXPECT_GT(area("leaky", d2s1r::Cell::kFree), 1.1 * free);
	degrade({"blurred=0.1"}, "blurred");
	EXPECT_LT(area("blurred", d2s1r::Cell::kFree), 0.95 * free);
	degrade({"moved=1"}, "moved");
	EXPECT_NE(grid("moved").cells, grid("site").cells);
	EXPECT_NEAR(area("moved", d2s1r::Cell::kOccupied), walls, 0.3 * walls);
}

TEST_F(LearningData, GroundTruthMovesWithAWarpedMap)
{
	draw("office", "250", "7", "site");
	degrade({"warped=0.3"}, "warped");
	const auto before = positions("site/scans_gt.txt"), after = positions("warped/gt.txt");
	ASSERT_EQ(before.size(), after.size());
	double most = 0;
	for (std::size_t i = 0; i < before.size(); i++)
		most = std::max(most, std::hypot(after[i][0] - before[i][0], after[i][1] - before[i][1]));
	EXPECT_GT(most, 0.05);
	EXPECT_LE(most, 0.3);
	const auto total = [](const std::vector<double>& values)
	{ return std::accumulate(values.begin(), values.end(), 0.0); };
	EXPECT_LT(
	    total(errors("warped/map.yaml", "site/scans.rawlog", "warped/gt.txt")),
	    0.6 * total(errors("warped/map.yaml", "site/scans.rawlog", "site/scans_gt.txt")));
}

TEST_F(LearningData, TermsOfComparedPlacesSumUpToTheirLogLikelihood)
{
	draw("office", "250", "7", "site");
	const ProcessResult written = run_program(
	    {D2S1R_BUILD_DIR "/experiments/write_terms", path("site/map.yaml"), path("site/scans.rawlog"),
	     path("site/scans_gt.txt"), "none", path("frames.csv"), path("terms.csv.gz")});
	ASSERT_EQ(written.status, 0) << written.err;
	const auto frames = lines_of(read_file(path("frames.csv")));
	ASSERT_EQ(frames.size(), 31U);
	EXPECT_EQ(frames[1].substr(0, 10), "localized,");
	const ProcessResult unpacked = run_program({"zcat", path("terms.csv.gz")});
	ASSERT_EQ(unpacked.status, 0) << unpacked.err;
	const auto lines = lines_of(unpacked.out);
	ASSERT_GT(lines.size(), 30U);
	const d2s1r::BeamModel model;
	const std::vector<double> weights{model.on_wall,           model.off_wall,      model.log_range,
	                                  model.through_wall,      model.unknown_metre, model.off_wall_run,
	                                  model.no_return_at_wall, model.depth_edge};
	for (std::size_t i = 1; i < lines.size(); i++)
	{
		std::vector<double> numbers;
		std::istringstream words(lines[i]);
		for (std::string word; std::getline(words, word, ',');) numbers.push_back(std::stod(word));
		ASSERT_EQ(numbers.size(), 10 + weights.size());
		const double sum = std::inner_product(weights.begin(), weights.end(), numbers.begin() + 10, 0.0);
		EXPECT_NEAR(sum, numbers[3], 1e-3 * (1 + std::abs(numbers[3]))) << lines[i];
	}
}

TEST_F(LearningData, WeightsAreLearnedFromAUsersScansAlwaysTheSame)
{
	draw("office", "250", "7", "site");
	const auto learn = [&](const std::string& output)
	{
		const ProcessResult learned = run_program(
		    {kPython, std::string(D2S1R_SOURCE_DIR) + "/experiments/learn.py", "--build", D2S1R_BUILD_DIR, "--map",
		     path("site/map.yaml"), "--rawlog", path("site/scans.rawlog"), "--ground-truth", path("site/scans_gt.txt"),
		     "--frames", "3", "--floors", "2", "--output", path(output)});
		EXPECT_EQ(learned.status, 0) << learned.err;
		return read_file(path(output + "/learned.ini"));
	};
	const std::string ini = learn("learned");
	for (const char* part :
	     {"[scoring]", "temperature = ", "[beam_model]", "on_wall = ", "[presence_model]", "bias = "})
		EXPECT_NE(ini.find(part), std::string::npos) << part << " is not in\n" << ini;
	EXPECT_EQ(learn("again"), ini);
	const auto off =
	    errors("site/map.yaml", "site/scans.rawlog", "site/scans_gt.txt", {"-c", path("learned/learned.ini")});
	EXPECT_GE(std::count_if(off.begin(), off.end(), [](double error) { return error < 0.1; }), 25);
}

TEST_F(LearningData, MirroredScansAreOfNoPlace)
{
	EXPECT_EQ(
	    printed("from learning.sets import Set, mirrored\n"
	            "plain = Set('a', 'real', ('a',), 'map', 'scans', 'truth', (), ('frames=40', 'beams=90'))\n"
	            "worse = Set('b', 'map', ('a',), 'map', 'scans', 'truth', ('coarse=0.1',))\n"
	            "for one in mirrored([plain, worse], 7): print(one.name, one.kind, one.truth, *one.scan_words)"),
	    "a-mirrored mirrored None beams=90 frames=7 mirrored=1\n");
}

TEST_F(LearningData, ScansWhoseTruthTheLogContradictsAreLeftOut)
{
	write_file(folder() / "test_gt.txt", "1000.5 1 2 3\n1001 4 5 6\n");
	const std::string rows =
	    "import pathlib; from learning import sets\n"
	    "print(*sets.without_doubtful(pathlib.Path('" +
	    path("test_gt.txt") + "'))[:, 1])";
	EXPECT_EQ(printed(rows), "1.0 4.0\n");
	write_file(folder() / "test_scans.csv", "timestamp,on_walls,doubtful\n1000.5,0.9,1\n1001,0.2,0\n");
	EXPECT_EQ(printed(rows), "4.0\n");
}

TEST_F(LearningData, LookAlikesAreMappedByOneProgramAndSeenByAnother)
{
	for (const std::string folder : {"bays", "again"})
	{
		const ProcessResult drawn = run_program(
		    {kPython, script("look_alikes.py"), "pillars", "4", path(folder), "--drives", "1", "--frames", "20"});
		ASSERT_EQ(drawn.status, 0) << drawn.err;
	}
	for (const std::string file : {"map.png", "drive_0.log", "drive_0_gt.txt"})
		EXPECT_EQ(read_file(path("bays/" + file)), read_file(path("again/" + file))) << file;
	const auto off = errors("bays/map.yaml", "bays/drive_0.log", "bays/drive_0_gt.txt");
	EXPECT_GT(std::count_if(off.begin(), off.end(), [](double metres) { return metres < 0.3; }), 12) << "of 20";
	EXPECT_GT(*std::min_element(off.begin(), off.end()), 1e-3) << "the map is not the world";
}

TEST_F(LearningData, PresenceIsComparedAtOneRecall)
{
	if (run_program({kPython, "-c", "import matplotlib"}).status != 0)
		GTEST_SKIP() << "NO MATPLOTLIB: install Debian's python3-matplotlib";
	EXPECT_EQ(
	    printed("import numpy as np, presence\n"
	            "frames = presence.Frames.__new__(presence.Frames)\n"
	            "frames.kind = np.array(['real'] * 4 + ['mirrored', 'stranger'])\n"
	            "frames.is_right = np.array([True] * 3 + [False] * 3)\n"
	            "frames.share, frames.localized_above = np.ones(6), 0.9\n"
	            "odds = frames.shifted(np.array([-1.0, 1.0, 2.0, 0.0, 3.0, -3.0]), 50)\n"
	            "print(f'{odds[1]:.1f}', *frames.row('a', 'b', odds))"),
	    "2.2 a b 50.0 0.00 0.00 100.00\n")
	    << "ln(0.9 / 0.1)";
}

TEST_F(LearningData, EveryConstantThatAblateSwitchesOffIsInTheDefaultConfiguration)
{
	ASSERT_EQ(run({"--write-config", path("default.ini")}).status, 0);
	const std::string read = printed(
	    "import ablate\n"
	    "for c in ablate.read_constants(open('" +
	    path("default.ini") + "').read()): print(c.name, c.variants())");
	EXPECT_GT(lines_of(read).size(), 20U);
	EXPECT_NE(read.find("beam_model.on_wall {'off': 0.0}"), std::string::npos) << read;
}

TEST_F(LearningData, WrongWordsAreRefused)
{
	const ProcessResult wrong = run_program({kPython, script("degraded_maps.py"), "map.yaml", path("out"), "smered=1"});
	EXPECT_EQ(wrong.status, 1);
	EXPECT_NE(wrong.err.find("'smered=1' is not KIND=STRENGTH"), std::string::npos) << wrong.err;
	write_file(folder() / "world.txt", "seed 1\nwall both 0 0 1\n");
	const ProcessResult broken = run_program({kSimulateFloor, path("world.txt"), path("out")});
	EXPECT_EQ(broken.status, 1);
	EXPECT_NE(broken.err.find("world.txt:2: too few numbers"), std::string::npos) << broken.err;
}
