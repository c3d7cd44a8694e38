// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// experiments/tune.py, which finds the constants of windows and of the filter.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "experiment_scripts.h"
#include "tunings.h"

using namespace d2s1r::test;

class Tuning : public ExperimentScripts
{
   protected:
	Tuning() : ExperimentScripts("numpy, scipy, PIL") {}
};

namespace
{
/// Calls visit("section.name", number) for all constants of windows and of the filter that tune.py varies.
template <class Visit>
void visit_all(const Visit& visit)
{
	d2s1r::WindowTuning window;
	d2s1r::pf::Tuning filter;
	std::set<std::string> of_odometry;
	const auto odometry = [&](const char* name, auto number)
	{
		of_odometry.insert(name);
		visit("odometry." + std::string(name), static_cast<double>(number));
	};
	d2s1r::experiments::visit_numbers(window.odometry, odometry);
	std::set<std::string> of_others = of_odometry;  // learn_windows.py learns the model
	d2s1r::experiments::visit_numbers(window.model, [&](const char* name, double) { of_others.insert(name); });
	const auto others = [&](const std::string& section)
	{
		return [&, section](const char* name, auto number)
		{
			if (of_others.count(name) == 0) visit(section + name, static_cast<double>(number));
		};
	};
	d2s1r::experiments::visit_numbers(window, others("window."));
	d2s1r::experiments::visit_numbers(filter, others("filter."));
}
}  // namespace

TEST_F(Tuning, EveryConstantIsVaried)
{
	std::string expected;
	visit_all([&](const std::string& name, double) { expected += name + '\n'; });
	const auto sorted = [](const std::string& text)
	{
		const auto lines = lines_of(text);
		return std::set<std::string>(lines.begin(), lines.end());
	};
	EXPECT_EQ(sorted(printed("import tune\nfor c in tune.CONSTANTS: print(c.name)")), sorted(expected));
}

namespace
{
/// The numbers of a file of experiments/results/learned, by "section.name".
std::map<std::string, double> written_in(const std::string& file)
{
	std::istringstream stream(read_file(D2S1R_SOURCE_DIR "/experiments/results/learned/" + file));
	std::map<std::string, double> written;
	std::string section;
	for (std::string line; std::getline(stream, line);)
	{
		const auto equals = line.find(" = ");
		if (line.rfind('[', 0) == 0) section = line.substr(1, line.size() - 2) + '.';
		if (equals != std::string::npos) written[section + line.substr(0, equals)] = std::stod(line.substr(equals + 3));
	}
	return written;
}
}  // namespace

TEST(TunedConstants, DefaultsAreThoseThatTunePyWrote)
{
	std::map<std::string, double> defaults;
	visit_all([&](const std::string& name, double number) { defaults[name] = number; });
	EXPECT_EQ(written_in("tuned.ini"), defaults);
}

TEST(TunedConstants, TheModelOfWindowsIsWhatLearnWindowsPyWrote)
{
	d2s1r::WindowModel model;
	std::map<std::string, double> defaults;
	d2s1r::experiments::visit_numbers(
	    model, [&](const char* name, double number) { defaults["window." + std::string(name)] = number; });
	EXPECT_EQ(written_in("windows.ini"), defaults);
}

/// Frames of a made-up method: the nearer x.a is to 4, the more are right; x.b changes nothing; without x.c some are
/// sure at a wrong place.
constexpr const char* kMadeUp = R"(
import math
from learning import tuning
def evaluate(points):
    letters = []
    for point in points:
        right = max(0, 300 - int(100 * abs(math.log2(point['x.a'] / 4))))
        wrong = 60 if point['x.c'] == 0 else 0
        letters.append(['R' * right + '-' * (300 - right), 'W' * wrong + 'R' * (60 - wrong)])
    return letters
constants = [tuning.Constant('x.a', 1.0), tuning.Constant('x.b', 3.0), tuning.Constant('x.c', 0.5, 0, 1)]
)";

TEST_F(Tuning, GoesWhereFramesAreGainedAndNowhereElse)
{
	EXPECT_EQ(
	    printed(std::string(kMadeUp) + "print(sorted(tuning.search(evaluate, constants, lambda text: None).items()))"),
	    "[('x.a', 4.0), ('x.b', 3.0), ('x.c', 0.5)]\n");
}

TEST_F(Tuning, AFrameThatIsWrongAndSureOutweighsTenThatAreRight)
{
	const auto is_gain = [&](const std::string& after, const std::string& before)
	{ return printed("from learning import tuning\nprint(tuning.is_gain([" + after + "], [" + before + "]))"); };
	EXPECT_EQ(is_gain("100 * 'R'", "100 * 'r'"), "True\n");
	EXPECT_EQ(is_gain("100 * 'R'", "100 * 'R'"), "False\n");
	EXPECT_EQ(is_gain("10 * ('W' + 9 * 'R')", "100 * 'r'"), "False\n");
	EXPECT_EQ(is_gain("100 * 'r'", "10 * ('W' + 9 * 'R')"), "True\n");
	EXPECT_EQ(is_gain("'RRRR' + 96 * '-'", "100 * '-'"), "False\n") << "four frames in a row may be chance";
}

TEST_F(Tuning, ADriveThroughADrawnFloorIsFollowed)
{
	const std::string programs = D2S1R_BUILD_DIR "/experiments/";
	printed(
	    "import pathlib\nfrom learning import drawn_sites, drives\nfolder = pathlib.Path('" + folder().string() +
	    "')\nsimulate = pathlib.Path('" + programs +
	    "simulate_floor')\n"
	    "drawn_sites.draw_site(folder / 'site', 'office', 300, 10, 5, simulate)\n"
	    "(folder / 'drive').mkdir()\n"
	    "drives.write_drive(folder / 'site', folder / 'drive', 30, 5, simulate)\n");
	std::istringstream poses(read_file(folder() / "drive/scans_gt.txt"));
	std::vector<std::array<double, 2>> way;
	for (double time = 0, x = 0, y = 0, phi = 0; poses >> time >> x >> y >> phi;) way.push_back({x, y});
	ASSERT_EQ(way.size(), 30U);
	for (std::size_t i = 1; i < way.size(); i++)
		EXPECT_LT(std::hypot(way[i][0] - way[i - 1][0], way[i][1] - way[i - 1][1]), 0.6) << i;
	const ProcessResult followed = run_program(
	    {programs + "window_experiment", path("drive/map.yaml"), path("drive/scans.rawlog"), path("drive/scans_gt.txt"),
	     path("frames.csv"), "wheels=1"});
	ASSERT_EQ(followed.status, 0) << followed.err;
	const auto right = followed.out.find("window: right ");
	ASSERT_NE(right, std::string::npos) << followed.out;
	EXPECT_GE(std::stoi(followed.out.substr(right + 14)), 27) << followed.out;
}

TEST_F(Tuning, ResultsAreKeptAndTheSame)
{
	const auto tune = [&](const std::string& build, const std::string& output)
	{
		std::filesystem::create_directories(folder() / build);
		if (!std::filesystem::exists(folder() / build / "experiments"))
			std::filesystem::create_symlink(D2S1R_BUILD_DIR "/experiments", folder() / build / "experiments");
		const ProcessResult tuned = run_program(
		    {kPython, D2S1R_SOURCE_DIR "/experiments/tune.py", "--build", path(build), "--runs", "filter drawn",
		     "--only", "filter.unlisted", "--output", path(output)});
		EXPECT_EQ(tuned.status, 0) << tuned.err;
		const std::string table = read_file(path(output + "/tuned.md"));
		return read_file(path(output + "/tuned.ini")) + table.substr(table.find("## Every constant"));
	};
	const std::string found = tune("build", "tuned");
	EXPECT_NE(found.find("\nunlisted = "), std::string::npos) << found;
	EXPECT_NE(found.find("| filter.unlisted | half |"), std::string::npos) << found;
	EXPECT_EQ(tune("another", "again"), found) << "nothing was kept there";
	std::vector<std::filesystem::path> kept;
	for (const auto& entry : std::filesystem::recursive_directory_iterator(folder() / "build/learning/tuning"))
		if (entry.path().extension() == ".json") kept.push_back(entry.path());
	ASSERT_EQ(kept.size(), 1U);
	std::string letters = read_file(kept[0]);
	std::replace(letters.begin(), letters.end(), 'R', 'W');
	write_file(kept[0], letters);
	EXPECT_NE(tune("build", "from-kept").find("| all as found |  |  | 0 | 0 |"), std::string::npos);
}

TEST_F(Tuning, ResultsOfOtherDataAreOthers)
{
	const auto digest = [&]
	{
		return printed(
		    "import pathlib, tune\nfolder = pathlib.Path('" + folder().string() +
		    "')\nprint(tune.digest_of(folder / 'map.yaml', folder / 'run.rawlog', folder / 'gt.txt').hex())");
	};
	for (const char* file : {"map.yaml", "map.pgm", "run.rawlog", "gt.txt"}) write_file(folder() / file, file);
	const std::string before = digest();
	EXPECT_EQ(digest(), before);
	for (const char* file : {"map.yaml", "map.pgm", "run.rawlog", "gt.txt"})
	{
		write_file(folder() / file, "other");
		EXPECT_NE(digest(), before) << file;
		write_file(folder() / file, file);
	}
}

TEST_F(Tuning, AVariantSetsConstantsAndNothingElse)
{
	std::vector<double> set;
	const auto flags = [&](const d2s1r::WindowTuning& tuning)
	{
		set.push_back(tuning.lost_frames + tuning.fits);
		return std::string("R");
	};
	d2s1r::WindowTuning usual;
	usual.fits = 0.25;
	write_file(folder() / "variants", "lost_frames=7\n\nfits=0.5\n");
	d2s1r::experiments::print_variants(usual, path("variants"), flags);
	EXPECT_EQ(set, (std::vector<double>{7.25, usual.lost_frames + 0.25, usual.lost_frames + 0.5}));
	for (const char* word : {"reach=3.5", "frames=9", "apart=1", "wheels=1", "window=3", "surprise=5"})
	{
		write_file(folder() / "variants", word);
		EXPECT_THROW(d2s1r::experiments::print_variants(usual, path("variants"), flags), std::invalid_argument) << word;
	}
}

TEST_F(Tuning, WhatIsNoConstantIsRefused)
{
	const ProcessResult wrong =
	    run_program({D2S1R_BUILD_DIR "/experiments/window_experiment", "m", "r", "t", "f", "fitz=1"});
	EXPECT_EQ(wrong.status, 1);
	EXPECT_NE(wrong.err.find("'fitz=1' is not NAME=VALUE"), std::string::npos) << wrong.err;
}
