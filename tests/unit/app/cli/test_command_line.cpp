// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <shell/errors.h>
#include <shell/values.h>

#include <sstream>
#include <utility>
#include <vector>

#include "../temporary_folder.h"
#include "cli/command_line.h"

using namespace d2s1r;
using namespace d2s1r::app;

namespace
{
std::optional<CommandLine> parse_and_print(std::vector<std::string> words, std::string& printed)
{
	words.insert(words.begin(), "rawlog-localize");
	std::vector<char*> pointers;
	for (auto& word : words) pointers.push_back(word.data());
	std::ostringstream out;
	const auto command = parse_command_line(static_cast<int>(pointers.size()), pointers.data(), out);
	printed = out.str();
	return command;
}

std::optional<CommandLine> parse(const std::vector<std::string>& words)
{
	std::string ignored;
	return parse_and_print(words, ignored);
}

/// Parses a complete command line with `more` at its end.
CommandLine complete(const std::vector<std::string>& more = {})
{
	std::vector<std::string> words = {"-m", "a.yaml", "-i", "b.rawlog", "-o", "out"};
	words.insert(words.end(), more.begin(), more.end());
	return parse(words).value();
}

/// Returns the message of the error that parsing `words`, by parse() or complete(), leads to.
template <class Parser>
std::string refusal(const std::vector<std::string>& words, const Parser& parser)
{
	try
	{
		parser(words);
	}
	catch (const UserError& error)
	{
		EXPECT_EQ(error.status, kWrongUse);
		EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
		return error.what();
	}
	return "no error";
}
}  // namespace

TEST(CommandLine, SweepTime)
{
	EXPECT_FALSE(complete({}).log.overrides.sweep);
	const auto angles = complete({"--beam-angles", "-135,134.5"}).log.overrides.beam_angles;
	ASSERT_TRUE(angles);
	EXPECT_NEAR(angles->first, -0.75 * M_PI, 1e-9);
	EXPECT_NEAR(angles->last, 134.5 / 180 * M_PI, 1e-9);
	const auto sweep = complete({"--sweep-time", "-0.1,0.05"}).log.overrides.sweep;
	ASSERT_TRUE(sweep);
	EXPECT_DOUBLE_EQ(sweep->duration, -0.1);
	EXPECT_DOUBLE_EQ(sweep->first_beam, 0.05);
}

TEST(CommandLine, CloudHeight)
{
	EXPECT_FALSE(complete({}).log.cloud_height);
	const auto band = complete({"--cloud-height", "-0.5:1.5"}).log.cloud_height;
	ASSERT_TRUE(band);
	EXPECT_DOUBLE_EQ(band->from, -0.5);
	EXPECT_DOUBLE_EQ(band->to, 1.5);
}

TEST(CommandLine, DefaultsAreOneThreadAllFramesAndEveryScanOnItsOwn)
{
	const CommandLine command = complete();
	EXPECT_EQ(command.map.name(), "a.yaml");
	EXPECT_EQ(command.log.file, "b.rawlog");
	EXPECT_EQ(command.output.folder, "out");
	EXPECT_FALSE(command.search.window);
	EXPECT_FALSE(command.log.label);
	EXPECT_TRUE(command.search.query.prior.anywhere());
	EXPECT_EQ(command.search.query.time_budget, 0);
	EXPECT_EQ(command.log.frames.first, 0U);
	EXPECT_EQ(command.log.frames.past, std::numeric_limits<std::size_t>::max());
	EXPECT_EQ(command.search.seed, 1U);
	EXPECT_FALSE(command.search.fuse);
	EXPECT_FALSE(command.output.quiet);
}

TEST(CommandLine, ValuesMayFollowAnEqualsSignOrTheLetterItself)
{
	const CommandLine command = parse({"-ma.yaml", "--input=b.rawlog", "-oout", "--region=-1,-2,3,4.5"}).value();
	EXPECT_EQ(command.map.name(), "a.yaml");
	EXPECT_EQ(command.log.file, "b.rawlog");
	EXPECT_EQ(command.output.folder, "out");
	EXPECT_FALSE(command.search.query.prior.anywhere());
	EXPECT_EQ(complete({"--region", "-1,-2,3,4.5"}).search.query.prior.boxes.size(), 1U);
}

TEST(CommandLine, FramesAreARangeWithOpenEnds)
{
	EXPECT_EQ(complete({"--frames", "3:7"}).log.frames.first, 3U);
	EXPECT_EQ(complete({"--frames", "3:7"}).log.frames.past, 7U);
	EXPECT_EQ(complete({"--frames", ":7"}).log.frames.first, 0U);
	EXPECT_EQ(complete({"--frames", "3:"}).log.frames.past, std::numeric_limits<std::size_t>::max());
	EXPECT_EQ(complete({"--frames", "3:7"}).log.frames.step, 1U);
	EXPECT_EQ(complete({"--frames", "010::5"}).log.frames.first, 10U);
	EXPECT_EQ(complete({"--frames", "010::5"}).log.frames.step, 5U);
}

TEST(CommandLine, AWindowOfOneScanIsNoWindow)
{
	EXPECT_FALSE(complete({"--window", "1"}).search.window);
	EXPECT_EQ(complete({"--window", "10"}).search.window, 10);
}

TEST(CommandLine, FramesBeyondAnyLogAreRefusedForThat)
{
	for (const char* frames : {"0:18446744073709551615:18446744073709551615", "0::18446744073709551615"})
		EXPECT_NE(refusal({"--frames", frames}, complete).find("is beyond any log"), std::string::npos) << frames;
}

TEST(CommandLine, ParametersAreSetOneByOne)
{
	EXPECT_EQ(
	    complete({"--set", "scan.no_return=1", "--set=scan.min_beams=5"}).search.settings,
	    (std::vector<std::string>{"scan.no_return=1", "scan.min_beams=5"}));
}

TEST(CommandLine, AnEmptyValueIsRefusedExceptForALabel)
{
	EXPECT_EQ(complete({"--sensor-label", ""}).log.label, "");
	for (const std::string option : {"--map",          "--input",        "--output",  "--config",     "--set",
	                                 "--ground-truth", "--frames",       "--threads", "--window",     "--region",
	                                 "--time-budget",  "--seed",         "--plugins", "--motion",     "--save-map",
	                                 "--write-config", "--write-pf-ini", "--index",   "--resolution", "--origin"})
		for (const std::vector<std::string>& words : {std::vector{option, std::string()}, std::vector{option + "="}})
			EXPECT_EQ(refusal(words, parse).rfind(option + ": needs a value", 0), 0U) << refusal(words, parse);
}

TEST(CommandLine, ValuesThatMakeNoSenseAreRefused)
{
	struct Case
	{
		std::vector<std::string> words;
		std::string part;
	};
	const std::vector<Case> wrong = {
	    {{"--threads", "0"}, "--threads"},
	    {{"--threads", "257"}, "--threads"},
	    {{"--threads", "two"}, "two"},
	    {{"--threads", "2.5"}, "--threads: '2.5' is not a whole number from 1 to 256"},
	    {{"--seed", "-1"}, "--seed"},
	    {{"--cloud-height", "1"}, "write A:B in m"},
	    {{"--cloud-height", "1:0.5"}, "is an empty band of heights"},
	    {{"--cloud-height", "low:high"}, "low"},
	    {{"--sweep-time", "slow"}, "slow"},
	    {{"--beam-angles", "270"}, "write FIRST,LAST in deg"},
	    {{"--beam-angles", "-135,-135"}, "are not 1 to 361 deg apart"},
	    {{"--sweep-time", "0.1,0,0"}, "write S or S,FIRST in s"},
	    {{"--sweep-time", "100"}, "--sweep-time: '100' is longer than any laser takes"},
	    {{"--max-range", "0"}, "--max-range: '0' is not a range above 0 m"},
	    {{"--max-range", "-1"}, "--max-range: '-1' is not a range above 0 m"},
	    {{"--max-range", "1e-300"}, "--max-range: '1e-300' is not a range above 0 m"},
	    {{"--max-range", "1e300"}, "--max-range: '1e300' is farther than a laser sees"},
	    {{"--save-map", "saved.yaml"}, "FILE.signaturemap"},
	    {{"--save-map", "saved.PNG"}, "FILE.signaturemap"},
	    {{"--window", "0"}, "1 to 1000"},
	    {{"--window", "1001"}, "1 to 1000"},
	    {{"--window", "ten"}, "ten"},
	    {{"--region", "1,2,3"}, "X0,Y0,X1,Y1"},
	    {{"--region", "1,2,3,4,5"}, "X0,Y0,X1,Y1"},
	    {{"--region", "1,2,1,4"}, "empty box"},
	    {{"--region", "1,2,inf,4"}, "finite"},
	    {{"--region", "1,2,,4"}, "number"},
	    {{"--time-budget", "0"}, "above 0"},
	    {{"--time-budget", "inf"}, "'inf' is not a finite time"},
	    {{"--time-budget", "nan"}, "above 0"},
	    {{"--time-budget", "fast"}, "fast"},
	    {{"--frames", "7"}, "A:B"},
	    {{"--frames", "9:3"}, "no frame"},
	    {{"--frames", "3:3"}, "no frame"},
	    {{"--frames", "-1:3"}, "--frames"},
	    {{"--frames", "a:b"}, "--frames"},
	    {{"--frames", "1:9:0"}, "at least 1"},
	    {{"--frames", "1:9:2:2"}, "A:B:STEP"},
	    {{"--motion", "both"}, "--motion"},
	    {{"--unknown", "1"}, "--unknown"},
	    {{"--resolution", "0"}, "0.001 to 10 m"},
	    {{"--resolution", "1e-9"}, "0.001 to 10 m"},
	    {{"--resolution", "11"}, "0.001 to 10 m"},
	    {{"--resolution", "nan"}, "0.001 to 10 m"},
	    {{"--resolution", "0.05"}, "only goes with an image (.png, "},
	    {{"--origin", "1,2"}, "--resolution"},
	    {{"--resolution", "0.05", "--origin", "1"}, "--origin: '1' is not a point; write X,Y in m"}};
	for (const auto& [words, part] : wrong)
	{
		const std::string message = refusal(words, complete);
		for (const std::string& told : {words[words.size() - 2], part, std::string("see rawlog-localize --help")})
			EXPECT_NE(message.find(told), std::string::npos) << message << " lacks " << told;
	}
}

TEST(CommandLine, AMisspelledOptionIsNamedAsItMayHaveBeenMeant)
{
	for (const auto& [given, meant] :
	     {std::pair("--windw", "--window"),
	      {"--bag", "--input"},
	      {"--thread=2", "--threads"},
	      {"--ouptut", "--output"},
	      {"--diag", "--diagnose"}})
	{
		const std::string message = refusal({given}, complete);
		EXPECT_NE(message.find("is not an option; did you mean " + std::string(meant) + "?"), std::string::npos)
		    << message;
	}
	EXPECT_NE(
	    refusal({"map.yaml"}, complete).find("map.yaml: stands without an option; write -m MAP"), std::string::npos);
	for (const char* given : {"--bogus", "stray", "-x"})
		EXPECT_EQ(refusal({given}, complete).find("did you mean"), std::string::npos) << given;
}

TEST(CommandLine, OptionsThatGoTogetherAreGivenTogether)
{
	EXPECT_EQ(complete({"--fuse", "--motion", "odometry"}).search.motion, MotionSource::kOdometry);
	EXPECT_NE(refusal({"--motion", "both"}, complete).find("--motion: only goes with --fuse"), std::string::npos);
	EXPECT_EQ(complete({"--topic", "/scan"}).log.label, "/scan");
	EXPECT_STREQ(complete({"--topic", "/scan"}).log.label_option, "--topic");
	EXPECT_NE(
	    refusal({"--topic", "/a", "--sensor-label", "/b"}, complete).find("--topic: is the same"), std::string::npos);
	const auto image =
	    parse({"-m", "a.png", "-i", "b", "-o", "c", "--origin", "1,2", "--resolution", "0.1"})->map.image;
	EXPECT_EQ(image->resolution, 0.1);
	EXPECT_EQ(image->origin_y, 2);
}

TEST(CommandLine, OnlyWritingAConfigurationNeedsNoMap)
{
	EXPECT_TRUE(parse({"--write-config", "all.ini"})->only_writes_config());
	EXPECT_THROW(parse({"-m", "a.yaml", "--write-config", "all.ini"}), UserError);
}

using CalibrationFile = d2s1r::test::FolderTest;

TEST_F(CalibrationFile, GivesWhatTheCommandLineDoesNot)
{
	write("good.yaml", "# by hand\nsensor-pose: 1,2,0,90,0,0\nmin-range: 0.25\nmirrored-odometry: true\n");
	ros::Overrides overrides;
	overrides.min_range = 0.5;
	read_calibration(path("good.yaml"), overrides);
	EXPECT_DOUBLE_EQ(overrides.sensor_pose.value().x(), 1);
	EXPECT_DOUBLE_EQ(overrides.min_range.value(), 0.5);
	EXPECT_TRUE(overrides.is_odometry_mirrored);
}

TEST_F(CalibrationFile, IsRefusedByALineThatNamesIt)
{
	const auto refusal = [&](const std::string& file)
	{
		ros::Overrides overrides;
		try
		{
			read_calibration(file, overrides);
		}
		catch (const UserError& error)
		{
			return std::string(error.what());
		}
		return std::string();
	};
	write("no.yaml", "mirrored-odometry: false\n");
	EXPECT_NE(refusal(path("no.yaml")).find("leave the line out"), std::string::npos) << refusal(path("no.yaml"));
	write("range.yaml", "min-range: -1\n");
	EXPECT_NE(refusal(path("range.yaml")).find("is not a range above 0 m"), std::string::npos);
	write("long.yaml", std::string(1'000'000, 'a'));
	EXPECT_NE(refusal(path("long.yaml")).find("is too long"), std::string::npos);
	EXPECT_NE(refusal("/dev/zero").find("cannot be read"), std::string::npos) << "it has no end";
	EXPECT_NE(refusal(path("none.yaml")).find("cannot be read"), std::string::npos);
}

TEST(CommandLine, HelpAndVersionArePrintedWhateverElseIsThere)
{
	std::string printed;
	EXPECT_FALSE(parse_and_print({"--help"}, printed));
	EXPECT_EQ(printed.rfind("Usage: rawlog-localize", 0), 0U) << printed;
	for (const char* group : {"\nInput:\n", "\nLaser:\n", "\nSearch:\n", "\nOutput:\n", "\nLive:\n", "\nHelp:\n"})
		EXPECT_NE(printed.find(group), std::string::npos) << printed;
	std::istringstream lines(printed);
	for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 102U) << line;
	EXPECT_FALSE(parse_and_print({"-m", "a.yaml", "--version"}, printed));
	EXPECT_EQ(printed.rfind("rawlog-localize (d2s1r) ", 0), 0U) << printed;
}
