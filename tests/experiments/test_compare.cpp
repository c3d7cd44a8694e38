// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// experiments/compare.py on a user's own folder, the intervals that its tables give, and the fingerprint beside tables.
#include <d2s1r/version.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <iomanip>
#include <sstream>

#include "app_process.h"
#include "app_world.h"
#include "experiment_scripts.h"
#include "walk_logs.h"

using namespace d2s1r::test;
namespace fs = std::filesystem;

class Compare : public ExperimentScripts
{
   protected:
	Compare() : ExperimentScripts("matplotlib, numpy") {}

	/// Writes the flat as a map_server map, and the scans of the walk with their truth, under names of a user's own.
	void write_own_site() const
	{
		fs::create_directories(path("home"));
		save_map(flat(), path("home/kitchen.yaml"));
		save(observation_log(), path("home/drive.rawlog"));
		save_truth(path("home/drive_truth.txt"), false);
	}

	ProcessResult compare(const Words& more) const
	{
		Words words = {
		    kPython,
		    "-B",
		    std::string(D2S1R_SOURCE_DIR) + "/experiments/compare.py",
		    "--build",
		    D2S1R_BUILD_DIR,
		    "--output",
		    path("out"),
		    "--store",
		    path("store")};
		words.insert(words.end(), more.begin(), more.end());
		return run_program(words);
	}
};

TEST_F(Compare, AFolderOfOnesOwnGetsAPageWithTablesPicturesAndReferences)
{
	write_own_site();
	fs::create_directories(path("peers"));
	write_file(
	    path("peers/cbgl"),
	    "#!/bin/sh\nread -r map resolution x y < \"$1\"\ntest -s \"$(dirname \"$1\")/$map\" || exit 1\n"
	    "echo 'timestamp,status,x,y,phi,confidence,total_ms' > \"$3\"\n"
	    "while read -r time rest; do echo \"$time,localized,0,0,0,1,5\" >> \"$3\"; done < \"$2\"\n"
	    "echo '{\"preparation_s\": 0.5, \"memory_mb\": 7}'\n");
	fs::permissions(path("peers/cbgl"), fs::perms::owner_all);
	const ProcessResult result = compare(
	    {path("home"), "--most", "6", "--most-others", "2", "--only", "d2s1r,published-10,exhaustive,glare,cbgl",
	     "--peers", path("peers")});
	ASSERT_EQ(result.status, 0) << result.err;
	const std::string page = read_file(path("out/README.md"));
	for (const char* part :
	     {"## home, all scans", "| d2s1r | 6 | 100.0 (36.8 to 100.0) | - | 100.0 |",
	      "| published method, k = 10 | 6 | ", "| exhaustive likelihood field | 2 | ",
	      "| CBGL with PL-ICP | 2 | 0.0 (0.0 to 83.6) | 100.0 ", "| 7 | 5.0, 5.0 | 0.50 |",
	      "d2s1r against the best of the published method (published method, k = 10)", "## Settings",
	      "| home | kitchen.yaml | drive.rawlog | drive_truth.txt | 6 |",
	      "| home | GLARE | needs the scans that built the map", "](success.png)", "](reliability.png)",
	      "](home_map.png)", "MB:\nmemory, the peak of the program", "median over scans of the longest return |",
	      "the best on at most 100 of these scans"})
		EXPECT_NE(page.find(part), std::string::npos) << part << " is not in\n" << page;
	EXPECT_EQ(page.find("The weights of d2s1r were learned"), std::string::npos) << "nobody knows of this site";
	const CsvTable frames(
	    path("out/frames.csv"),
	    "site,method,timestamp,in_map,status,x,y,phi,confidence,true_x,true_y,true_phi,right,ms");
	EXPECT_EQ(frames.size(), 6U + 6U + 2U + 2U);
	const std::string latex = read_file(path("out/table.tex"));
	for (const char* part :
	     {"home & d2s1r & 6 & ", ". A success is a best pose within 0.3 m and 5 degrees of the truth"})
		EXPECT_NE(latex.find(part), std::string::npos) << latex;
	const std::string references = read_file(path("out/references.bib"));
	for (const char* entry :
	     {"@book{probabilistic-robotics", "@misc{amcl", "@inproceedings{cbgl", "@inproceedings{pl-icp"})
		EXPECT_NE(references.find(entry), std::string::npos) << entry;
	EXPECT_NE(references.find("@misc{d2s1r-software"), std::string::npos);
	EXPECT_NE(references.find("version " D2S1R_VERSION ", commit "), std::string::npos) << references;
	EXPECT_EQ(references.find("@inproceedings{glare"), std::string::npos) << "it was not run";
	EXPECT_FALSE(fs::is_empty(path("out/logs")));
	for (const auto& entry : fs::directory_iterator(path("store")))
		EXPECT_TRUE(nlohmann::json::accept(read_file(entry.path().string())))
		    << entry.path() << ": nothing is unpickled";
}

TEST_F(Compare, WhatCannotBeComparedIsNamed)
{
	fs::create_directories(path("empty"));
	EXPECT_NE(compare({path("empty")}).err.find("holds no map; a SITE is a folder with"), std::string::npos);
	write_own_site();
	fs::remove(path("home/drive_truth.txt"));
	EXPECT_NE(compare({path("home")}).err.find("holds no truth"), std::string::npos);
	const auto with_truth = [&](const std::string& text, const Words& more = {})
	{
		write_file(path("home/gt.txt"), text);
		Words words = {path("home"), "--only", "d2s1r"};
		words.insert(words.end(), more.begin(), more.end());
		return compare(words).err;
	};
	EXPECT_NE(with_truth("1 2 3\n").find("`1 2 3` is neither"), std::string::npos);
	EXPECT_NE(with_truth("1 2 nan 0\n").find("`1 2 nan 0` holds a number that is not finite"), std::string::npos);
	EXPECT_NE(with_truth("# time x y phi\n").find("gt.txt: holds no pose"), std::string::npos);
	const std::string other_time = with_truth("1 2 3 0\n");
	EXPECT_NE(other_time.find("gt.txt: tells the pose of no scan of drive.rawlog"), std::string::npos) << other_time;
	EXPECT_NE(compare({path("home"), path("home")}).err.find("as another site is"), std::string::npos);
	EXPECT_NE(with_truth("1 2 3 0\n", {"--map", path("no.yaml")}).find("no.yaml: is not there"), std::string::npos);
	EXPECT_NE(with_truth("1 2 3 0\n", {"--most", "0"}).find("--most: invalid positive int"), std::string::npos);
	EXPECT_NE(compare({path("home"), "--only", "magic"}).err.find("no method magic"), std::string::npos);
}

TEST_F(Compare, ASiteOfOneScanMayHaveAnyNameAndATurnedMap)
{
	write_own_site();
	const std::string site = path("my flat & #1");
	fs::rename(path("home"), site);
	const auto& [x, y, phi] = walk().front();
	const double yaw = 0.5, c = std::cos(yaw), s = std::sin(yaw);
	std::ostringstream truth;
	truth << std::setprecision(17) << walk_time(0) << ' ' << c * x - s * y + 3 << ' ' << s * x + c * y - 1 << ' '
	      << phi + yaw << '\n';
	write_file(site + "/drive_truth.txt", truth.str());
	write_file(
	    site + "/kitchen.yaml",
	    "image: \"kitchen.pgm\"  # drawn\nresolution: 0.1\norigin:\n- 3.0\n- -1.0\n- 0.5\nnegate: 0\n"
	    "occupied_thresh: 0.65\nfree_thresh: 0.196\n");
	fs::create_directories(path("peers"));
	write_file(path("peers/cbgl"), "");
	fs::permissions(path("peers/cbgl"), fs::perms::owner_all);
	const ProcessResult result = compare({site, "--only", "d2s1r,cbgl", "--peers", path("peers")});
	ASSERT_EQ(result.status, 0) << result.err;
	const std::string page = read_file(path("out/README.md"));
	for (const char* part :
	     {"## my_flat_1, all scans", "| d2s1r | 1 | 100.0 (8.9 to 100.0) | - | 100.0 |", "](my_flat_1_map.png)",
	      "| my_flat_1 | CBGL with PL-ICP | its map must be a yaml of map_server that is not turned |"})
		EXPECT_NE(page.find(part), std::string::npos) << part << " is not in\n" << page;
	EXPECT_TRUE(fs::exists(path("out/my_flat_1_map.png")));
	EXPECT_FALSE(fs::exists(path("out/runs")));
}

TEST_F(Compare, APageSaysWhatFlattersAMethodOnItsSites)
{
	const auto notes = [&](const std::string& names, int field_of_view, const std::string& log)
	{
		return printed(
		    "import comparison_page, pathlib\nfrom types import SimpleNamespace as Made\nnames = '" + names +
		    "'.split()\nprint(comparison_page.notes(Made(cases={name: Made(log=pathlib.Path('" + log +
		    ".rawlog')) for name in names}, answers={(name, 'published-10'): Made(facts={'field_of_view': " +
		    std::to_string(field_of_view) + "}) for name in names})), end='')");
	};
	const std::string learned = "The weights of d2s1r were learned on other sets of the drives intel, fr079,",
	                  narrow = "The published method needs full circles. On ", refined = " was refined by d2s1r itself",
	                  registered = " is a registration, good to 0.1 m";
	const auto expect = [&](const std::string& text, const Words& parts, const Words& others)
	{
		for (const std::string& part : parts)
			EXPECT_NE(text.find(part), std::string::npos) << part << " not in " << text;
		for (const std::string& other : others)
			EXPECT_EQ(text.find(other), std::string::npos) << other << " in " << text;
	};
	EXPECT_EQ(notes("home", 359, "drive"), "");
	expect(notes("home", 180, "drive"), {narrow + "home,"}, {learned, refined, registered});
	expect(
	    notes("intel aces", 180, "test"), {learned, narrow + "intel and aces,", "intel and aces" + refined},
	    {registered});
	expect(notes("olin_mac_923", 359, "test"), {learned, "mines and olin", registered}, {narrow, refined, "headings"});
	expect(notes("mines_runs home", 240, "test"), {"of mines_runs" + registered, "headings of mines_runs"}, {refined});
	expect(notes("intel", 360, "sim360_on"), {learned}, {narrow, refined, registered});
	EXPECT_EQ(printed("import compare, methods\nprint(f'at most {compare.TRIED} of' in methods.READINGS)"), "True\n");
}

TEST_F(Compare, AnswersOfOtherCommitsAreNamed)
{
	const auto told = [&](const std::string& peer)
	{
		return printed(
		    "import comparison_page\nfrom types import SimpleNamespace as Made\n"
		    "class Job:\n    def __init__(self, method): self.method, self.site = method, Made(name='home')\n"
		    "print(*comparison_page.commits_of({Job('d2s1r'): Made(commit='abc'), Job('cbgl'): Made(commit='" +
		    peer + "')}), sep='|')");
	};
	EXPECT_EQ(told("abc"), "abc|\n");
	EXPECT_EQ(
	    told("def-dirty"),
	    "abc|Of other commits: def-dirty (with changes that were not committed): CBGL with PL-ICP on home. \n");
}

TEST_F(Compare, TablesCountPosesAndDoNotRoundToAllOrNothing)
{
	EXPECT_EQ(
	    printed("import tables\nprint(*(tables.end(value, 0) for value in (0, 0.6, 1.2, 98.9, 99.6, 100)))"),
	    "0 0.6 1 99 99.6 100\n");
	EXPECT_NE(
	    printed("import math, runs, tables\n"
	            "def frame(error): return runs.Frame('localized', True, 0.95, (0, 0, 0), None, error, 0, {})\n"
	            "print(tables.reliability({('home', 'test', 'default'): [frame(0.1)] * 3 + [frame(math.inf)]}))")
	        .find("| home test | 3 | 0.050 |"),
	    std::string::npos);
}

TEST_F(Compare, TheHeadlineNamesASiteThatIsNotWhole)
{
	fs::create_directories(path("sites/intel"));
	const ProcessResult result = run_program(
	    {"/usr/bin/env", "D2S1R_DATA=" + path("sites"), kPython, "-B",
	     std::string(D2S1R_SOURCE_DIR) + "/experiments/headline.py", "--build", D2S1R_BUILD_DIR});
	EXPECT_EQ(result.status, 1);
	EXPECT_NE(result.err.find("headline.py: " + path("sites/intel") + ": holds no map"), std::string::npos)
	    << result.err;
}

TEST_F(Compare, TruthIsReadInAllFormsAndBetweenTwoLines)
{
	write_file(path("mrpt.txt"), "% time x y z yaw pitch roll\n10 1 2 0 0.5 0 0\n10.4 2 2 0 0.7 0 0\n12 0 0 0 0 0 0\n");
	write_file(path("tum.txt"), "10 1 2 0 0 0 0.247403959 0.968912422\n");
	EXPECT_EQ(
	    printed(
	        "import pathlib, sites\nread = lambda name: sites.Truth.read(pathlib.Path('" + folder().string() +
	        "') / name)\nmrpt, tum = read('mrpt.txt'), read('tum.txt')\n"
	        "print([round(v, 3) for v in mrpt.at(10.1)], mrpt.at(11), mrpt.at(9.9), [round(v, 3) for v in "
	        "tum.at(10.0005)])"),
	    "[1.25, 2.0, 0.55] None None [1.0, 2.0, 0.5]\n");
}

TEST_F(Compare, TruthMayBeATopicOrAFrameOfTheLog)
{
	write_own_site();
	fs::remove(path("home/drive_truth.txt"));
	fs::remove(path("home/drive.rawlog"));
	std::vector<MadeMessage> messages = {made_transforms(Wire::kCdr, 1, {{"base_link", "laser", 0.1, 0, 0.2}})};
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		const auto time = std::llround(walk_time(i) * 10) * 100'000'000;
		const auto& pose = walk()[i];
		messages.push_back(
		    made_transforms(Wire::kCdr, time, {{"map", "base_link", pose.x, pose.y, 0, 'z', pose.phi}}, "/tf"));
		messages.push_back(made_scan(Wire::kCdr, ros_scan(i)));
	}
	write_file(path("home/drive.mcap"), mcap_file(messages));
	const auto told = [&](const std::string& truth) {
		return compare({path("home"), "--truth", truth, "--only", "d2s1r", "--most", "6"});
	};
	const ProcessResult result = told("tf:map");
	ASSERT_EQ(result.status, 0) << result.err;
	EXPECT_NE(read_file(path("out/README.md")).find("| d2s1r | 6 | 100.0 "), std::string::npos);
	EXPECT_NE(told("topic:/pose").err.find("on the topic '/pose'"), std::string::npos);
	EXPECT_NE(told("tf:hall").err.find("'hall'"), std::string::npos);
}

TEST_F(Compare, IntervalsHoldTheTruthOfDrivesWhoseFailuresComeInRuns)
{
	const ProcessResult told =
	    run_program({kPython, "-B", std::string(D2S1R_SOURCE_DIR) + "/experiments/intervals.py", "--series", "20"});
	EXPECT_EQ(told.status, 0) << told.out << told.err;
	EXPECT_NE(told.out.find("Over all: 9"), std::string::npos) << told.out;
}

TEST_F(Compare, PairedDifferencesAndBuildingsHaveIntervals)
{
	EXPECT_EQ(
	    printed("import intervals\n"
	            "run = [0] * 40 + [1] * 10 + [0] * 40\n"
	            "lone = [1 if i % 9 == 0 else 0 for i in range(90)]\n"
	            "def width(drives): mean, low, high = intervals.difference_interval(drives); return round(mean, 1), "
	            "high - low\n"
	            "print(width([run])[0], width([lone])[0], width([run])[1] > 2 * width([lone])[1])\n"
	            "alike, apart = [[True] * 90 + [False] * 10] * 8, [[True] * 100] * 7 + [[True] * 20 + [False] * 80]\n"
	            "def places(of): low, high = intervals.share_interval_of_places(of); return high - low\n"
	            "print(places(apart) > 3 * places(alike))\n"
	            "print(width([[1, 1, 1, 1, 0, 0, 0, 0, 1, 0]])[1] > 60, width([[1] * 10])[1] > 20)"),
	    "11.1 11.1 True\nTrue\nTrue True\n");
}

TEST_F(Compare, ATableOfOtherAnswersIsFoundUnlessItSaysSo)
{
	const auto stamp = [](const std::string& kinds) { return "<!-- measured at abc1234: " + kinds + " -->\n"; };
	const auto faults = [&](const std::string& readme, const std::string& results)
	{
		fs::create_directories(path("experiments"));
		write_file(path("README.md"), readme);
		write_file(path("experiments/RESULTS.md"), results);
		return printed(
		    "import fingerprint, pathlib\nprint(*fingerprint.faults(pathlib.Path('" + folder().string() +
		    "'), {'answers': '0123456789ab', 'tracker': 'ab0123456789'}), sep='\\n')");
	};
	const std::string today = stamp("answers 0123456789ab"), told = stamp("answers of another commit");
	EXPECT_EQ(faults(today, today), "\n");
	EXPECT_EQ(faults(today, told), "\n");
	EXPECT_EQ(faults(today, stamp("answers 0123456789ab, tracker ab0123456789")), "\n");
	EXPECT_EQ(faults(today, stamp("answers of another commit, tracker ab0123456789")), "\n");
	for (const std::string other :
	     {"answers ffff456789ab", "tracker 0123456789ab", "answers 0123456789ab, tracker ffff456789ab",
	      "answers 0123456789ab, trackers of another commit", "answers"})
		EXPECT_EQ(faults(today, stamp(other)).find("experiments/RESULTS.md: measured at abc1234"), 0U) << other;
	EXPECT_EQ(faults(stamp("answers ffff456789ab"), today).find("README.md: measured at abc1234"), 0U);
	EXPECT_EQ(faults(told, today).find("README.md: its table must be of today's answers"), 0U);
	EXPECT_EQ(faults("no table", today).find("README.md: does not say of which commit"), 0U);
	for (const std::string other :
	     {"<!-- measured at abc1234 answers 0123456789ab -->", "<!--measured at abc1234: answers\n0123456789ab -->"})
		EXPECT_EQ(faults(today, today + other).find("experiments/RESULTS.md: has a stamp that is not"), 0U) << other;
	const std::string table = "\n| a | b |\n| --- | --- |\n| 1 | 2 |\n\n";
	EXPECT_EQ(faults(today, "## One\n" + today + table + "### Two\n" + today + "Words" + table + "## Three\n"), "\n");
	EXPECT_EQ(
	    faults(today, "## One\n" + today + table + "### Two" + table + today),
	    "experiments/RESULTS.md: `Two` has a table and no stamp before it\n");
	EXPECT_EQ(
	    printed(
	        "import fingerprint\nprint(fingerprint.outdated('" + std::string("<!-- measured at abc1234: ") +
	        "windows 0123, filter 4567 -->', {'windows': '0123', 'filter': 'ffff'}))"),
	    "<!-- measured at abc1234: windows 0123, filter of another commit -->\n");
}

TEST_F(Compare, AFingerprintIsMadeOfAllAnswersOrNone)
{
	const auto error = [&](const std::string& script)
	{
		const std::string sources = D2S1R_SOURCE_DIR;
		const ProcessResult told = run_program(
		    {kPython, "-B", "-c",
		     "import pathlib, sys\nsys.path.insert(0, '" + sources +
		         "/experiments')\nimport fingerprint\nfolder = pathlib.Path('" + folder().string() + "')\n" + script});
		EXPECT_EQ(told.status, 1);
		return told.err;
	};
	const std::string empty = "fingerprint.py: office: frames.csv has no rows\n",
	                  of = "fingerprint.rows_of(folder / 'frames.csv', 'office')";
	EXPECT_EQ(error(of), empty);
	write_file(path("frames.csv"), "frame,status\n");
	EXPECT_EQ(error(of), empty);
	write_file(path("frames.csv"), "frame,status\n0,localized\n");
	EXPECT_EQ(
	    printed(
	        "import fingerprint, pathlib\nprint(len(fingerprint.rows_of(pathlib.Path('" + path("frames.csv") +
	        "'), '')))"),
	    "1\n");
	EXPECT_EQ(
	    error("fingerprint.stamp(folder, 'answers')")
	        .find("fingerprint.py: " + path("apps/rawlog-localize/rawlog-localize") + " is not there"),
	    0U);
	EXPECT_EQ(
	    error(
	        "fingerprint.outdated('<!-- measured at abc1234: trackers 0123456789ab -->', {'tracker': '0123456789ab'})"),
	    "fingerprint.py: <!-- measured at abc1234: trackers 0123456789ab -->: no kind of answers: trackers\n");
}
