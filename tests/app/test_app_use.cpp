// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Command lines, right and wrong.
#include <d2s1r/simd_targets.h>
#include <d2s1r/version.h>

#include <algorithm>
#include <optional>

#include "app_process.h"

using namespace d2s1r::test;

class AppUse : public AppTest
{
   protected:
	/// Returns the rows of all tables that a run wrote to `folder`.
	static std::vector<std::vector<std::string>> rows_without_times(const std::filesystem::path& folder)
	{
		std::vector<std::vector<std::string>> rows;
		for (const char* file :
		     {"frames.csv", "hypotheses.csv", "trajectory.tum", "trajectory.txt", "fused.csv", "fused.tum"})
		{
			rows.push_back({file});
			if (!std::filesystem::exists(folder / file)) continue;
			const std::string text = read_file(folder / file);
			if ((folder / file).extension() != ".csv")
			{
				rows.push_back({text});
				continue;
			}
			const CsvTable table(folder / file, text.substr(0, text.find('\n')));
			for (const auto& row : table.without_times()) rows.push_back(row);
		}
		return rows;
	}
};

TEST_F(AppUse, HelpNamesEveryOptionAndExitStatus)
{
	const auto result = run({"--help"});
	EXPECT_EQ(result.status, 0);
	EXPECT_EQ(result.err, "");
	for (const char* option :
	     {"--index",
	      "-m,",
	      "-i,",
	      "-o,",
	      "-c,",
	      "--ground-truth",
	      "--sensor-label",
	      "--frames",
	      "--threads",
	      "--window",
	      "--region",
	      "--time-budget",
	      "--seed",
	      "--plugins",
	      "--fuse",
	      "--motion",
	      "--save-map",
	      "--write-config",
	      "--write-pf-ini",
	      "--resolution",
	      "--origin",
	      "-q,",
	      "--version",
	      "--help",
	      "130"})
		EXPECT_NE(result.out.find(option), std::string::npos) << option;
}

TEST_F(AppUse, SetWinsOverTheConfiguration)
{
	write_file(path("c.ini"), "[scan]\nno_return = 0.5\nmin_beams = 7\n");
	const auto result = run(
	    {"--write-config", path("all.ini"), "-c", path("c.ini"), "--set", "scan.no_return=1", "--set",
	     "filter.particles=100"});
	EXPECT_EQ(result.status, 0) << result.err;
	const std::string all = read_file(path("all.ini"));
	for (const char* line : {"\nno_return = 1 ", "\nmin_beams = 7 ", "\nparticles = 100 "})
		EXPECT_NE(all.find(line), std::string::npos) << line;
	expect_refusal(
	    {"--write-config", path("all.ini"), "--set", "scan.no_retrun=1"}, 1,
	    {"--set: ", "did you mean scan.no_return?"});
}

TEST_F(AppUse, VersionIsThatOfTheProject)
{
	const auto result = run({"--version"});
	EXPECT_EQ(result.status, 0);
	EXPECT_EQ(
	    result.out.rfind("rawlog-localize (d2s1r) " D2S1R_VERSION "\nreads MRPT rawlogs, CARMEN logs, ROS 1 bags", 0),
	    0U)
	    << result.out;
}

/// Windows and the particle filter included.
TEST_F(AppUse, ResultsAreTheSameWithEachSimdTarget)
{
	const std::string office = D2S1R_SOURCE_DIR "/share/d2s1r/data/office";
	const std::vector<std::string> alone, together = {"--window", "5", "--fuse"};
	for (const auto& options : {alone, together})
	{
		std::optional<std::vector<std::vector<std::string>>> expected;
		for (const std::string& target : d2s1r::simd_targets())
		{
			std::vector<std::string> command = {
			    "env",
			    "D2S1R_SIMD=" + target,
			    RAWLOG_LOCALIZE,
			    "-m",
			    office + ".yaml",
			    "-i",
			    office + ".rawlog",
			    "-o",
			    path(target),
			    "--frames",
			    "::4",
			    "-q"};
			command.insert(command.end(), options.begin(), options.end());
			const auto result = run_program(command);
			ASSERT_EQ(result.status, 0) << target << result.err;
			const auto rows = rows_without_times(path(target));
			if (!expected) expected = rows;
			EXPECT_EQ(rows, *expected) << target;
			const std::string told = read_file(path(target + "/run.json"));
			EXPECT_NE(told.find("\"simd\": \"" + target + "\""), std::string::npos) << told;
		}
	}
}

TEST_F(AppUse, SimdTargetMustBeOneOfThisMachine)
{
	const std::vector<std::string> targets = d2s1r::simd_targets();
	EXPECT_EQ(targets.back(), "portable");
#if defined(__x86_64__)
	EXPECT_NE(std::find(targets.begin(), targets.end(), "ssse3"), targets.end()) << "not on the oldest of machines";
#elif defined(__aarch64__)
	EXPECT_EQ(targets.front(), "neon");
#endif
	const auto unknown = run_program({"env", "D2S1R_SIMD=mmx", RAWLOG_LOCALIZE, "--version"});
	EXPECT_EQ(unknown.status, 1);
	EXPECT_NE(
	    unknown.err.find("D2S1R_SIMD: 'mmx' is not a SIMD target of this machine; choose one of " + targets.front()),
	    std::string::npos)
	    << unknown.err;
}

TEST_F(AppUse, WriteConfigAloneWritesWhatConfigReads)
{
	EXPECT_EQ(run({"--write-config", path("first.ini")}).status, 0);
	EXPECT_EQ(run({"-c", path("first.ini"), "--write-config=" + path("second.ini")}).status, 0);
	EXPECT_NE(read_file(path("first.ini")).find("[localizer]"), std::string::npos);
	EXPECT_EQ(read_file(path("first.ini")), read_file(path("second.ini")));
}

TEST_F(AppUse, ConfigOfWriteConfigKeepsItsValues)
{
	write_file(path("own.ini"), "[paper]\nbins = 77\n");
	EXPECT_EQ(run({"-c", path("own.ini"), "--write-config", path("all.ini")}).status, 0);
	EXPECT_NE(read_file(path("all.ini")).find("77"), std::string::npos);
}

TEST_F(AppUse, RefusesIncompleteCommandLines)
{
	expect_refusal({}, 1, {"--map", "missing"});
	expect_refusal({"-m", "map.yaml"}, 1, {"--input", "missing"});
	expect_refusal({"-m", "map.yaml", "-i", "in.rawlog"}, 1, {"--output", "missing"});
	expect_refusal({"-m"}, 1, {"-m: needs a value", "--help"});
}

TEST_F(AppUse, RefusesUnknownWords)
{
	expect_refusal({"--bogus"}, 1, {"--bogus", "--help"});
	expect_refusal({"--windw", "3"}, 1, {"--windw: is not an option; did you mean --window?"});
	expect_refusal({"stray"}, 1, {"stray"});
	expect_refusal({"-q", "-q"}, 1, {"--quiet: is given more than once"});
	expect_refusal({"-q", "--seed=1", "--seed=2"}, 1, {"--seed: is given more than once"});
	expect_refusal({"--quiet=1"}, 1, {"--quiet: takes no value"});
	expect_refusal({"-q=3"}, 1, {"-q: takes no value"});
	expect_refusal({"-q", "--", "stray"}, 1, {"--: is not an option"});
	expect_refusal({"-mno=map\n.gridmap", "-i=no.rawlog", "-oout"}, 2, {"=no.rawlog: "});
}

TEST_F(AppUse, RefusesValuesThatMakeNoSense)  // of each option: CommandLine.ValuesThatMakeNoSenseAreRefused
{
	expect_refusal(
	    {"-m", "map.yaml", "-i", "in.rawlog", "-o", "out", "--threads", "2.5"}, 1,
	    {"--threads", "'2.5' is not a whole number from 1 to 256"});
	expect_refusal({"--map="}, 1, {"--map: needs a value"});
}

TEST_F(AppUse, RefusesWhatThePublishedMethodCannotDo)
{
	write_file(path("paper.ini"), "[localizer]\nmethod = paper\n");
	for (const Words& option : {Words{"--window", "5"}, Words{"--region", "0,0,1,1"}, Words{"--time-budget", "50"}})
		expect_refusal(
		    {"-m", "map.yaml", "-i", "in.rawlog", "-o", "out", "-c", path("paper.ini"), option[0], option[1]}, 1,
		    {option[0], "method = paper"});
}

TEST_F(AppUse, RefusesAPluginThatIsNotThere)
{
	expect_refusal(
	    {"-m", "map.yaml", "-i", "in.rawlog", "-o", path("out"), "--plugins", path("no.so")}, 1,
	    {"no.so", "No such file or directory; check the paths"});
}
