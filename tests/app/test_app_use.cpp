// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Command lines, right and wrong.
#include <d2s1r/version.h>

#include "app_process.h"

using namespace d2s1r::test;

class AppUse : public AppTest
{
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
	const auto run_with = [&](const std::string& target, const std::string& out)
	{
		return run_program(
		    {"env", "D2S1R_SIMD=" + target, RAWLOG_LOCALIZE, "-m", office + ".yaml", "-i", office + ".rawlog", "-o",
		     path(out), "--frames", "::4", "--window", "5", "--fuse", "-q"});
	};
	const auto usual = run_with("", "usual");
	ASSERT_EQ(usual.status, 0) << usual.err;
	int tried = 0;
	for (const char* target : {"avx3", "avx2", "neon", "portable"})
	{
		const auto result = run_with(target, target);
		if (result.status == 1 && result.err.find("not a SIMD target of this machine") != std::string::npos) continue;
		ASSERT_EQ(result.status, 0) << target << result.err;
		tried++;
		for (const auto& [file, header] :
		     {std::pair{"frames.csv", kFramesHeader}, {"hypotheses.csv", kHypothesesHeader}})
			EXPECT_EQ(
			    CsvTable(path(target) + "/" + file, header).without_times(),
			    CsvTable(path("usual") + "/" + file, header).without_times())
			    << target << ' ' << file;
		EXPECT_EQ(read_file(path(target) + "/fused.tum"), read_file(path("usual") + "/fused.tum")) << target;
		EXPECT_NE(
		    read_file(path(target) + "/run.json").find("\"simd\": \"" + std::string(target) + "\""), std::string::npos);
	}
	EXPECT_GE(tried, 1) << "the portable loops run everywhere";
	const auto unknown = run_with("mmx", "mmx");
	EXPECT_EQ(unknown.status, 1);
	EXPECT_NE(
	    unknown.err.find("D2S1R_SIMD: 'mmx' is not a SIMD target of this machine; choose one of"), std::string::npos)
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
