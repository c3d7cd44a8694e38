// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <sstream>
#include <vector>

#include "cli/errors.h"
#include "cli/flags.h"

using namespace d2s1r;
using namespace d2s1r::app;

namespace
{
std::optional<Flags> parse_and_print(std::vector<std::string> words, std::string& printed)
{
	words.insert(words.begin(), "rawlog-localize");
	std::vector<char*> pointers;
	for (auto& word : words) pointers.push_back(word.data());
	std::ostringstream out;
	const auto flags = parse_flags(static_cast<int>(pointers.size()), pointers.data(), out);
	printed = out.str();
	return flags;
}

std::optional<Flags> parse(const std::vector<std::string>& words)
{
	std::string ignored;
	return parse_and_print(words, ignored);
}

/// Parses a complete command line with `more` at its end.
Flags complete(const std::vector<std::string>& more = {})
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

TEST(Flags, DefaultsAreOneThreadAllFramesAndEveryScanOnItsOwn)
{
	const Flags flags = complete();
	EXPECT_EQ(flags.map, "a.yaml");
	EXPECT_EQ(flags.rawlog, "b.rawlog");
	EXPECT_EQ(flags.output_dir, "out");
	EXPECT_FALSE(flags.window);
	EXPECT_FALSE(flags.sensor_label);
	EXPECT_TRUE(flags.query.prior.anywhere());
	EXPECT_EQ(flags.query.time_budget, 0);
	EXPECT_EQ(flags.first_frame, 0U);
	EXPECT_EQ(flags.past_frame, std::numeric_limits<std::size_t>::max());
	EXPECT_EQ(flags.seed, 1U);
	EXPECT_FALSE(flags.fuse);
	EXPECT_FALSE(flags.quiet);
}

TEST(Flags, ValuesMayFollowAnEqualsSignOrTheLetterItself)
{
	const Flags flags = parse({"-ma.yaml", "--input=b.rawlog", "-oout", "--region=-1,-2,3,4.5"}).value();
	EXPECT_EQ(flags.map, "a.yaml");
	EXPECT_EQ(flags.rawlog, "b.rawlog");
	EXPECT_EQ(flags.output_dir, "out");
	EXPECT_FALSE(flags.query.prior.anywhere());
	EXPECT_EQ(complete({"--region", "-1,-2,3,4.5"}).query.prior.boxes.size(), 1U);
}

TEST(Flags, FramesAreARangeWithOpenEnds)
{
	EXPECT_EQ(complete({"--frames", "3:7"}).first_frame, 3U);
	EXPECT_EQ(complete({"--frames", "3:7"}).past_frame, 7U);
	EXPECT_EQ(complete({"--frames", ":7"}).first_frame, 0U);
	EXPECT_EQ(complete({"--frames", "3:"}).past_frame, std::numeric_limits<std::size_t>::max());
	EXPECT_EQ(complete({"--frames", "3:7"}).frame_step, 1U);
	EXPECT_EQ(complete({"--frames", "010::5"}).first_frame, 10U);
	EXPECT_EQ(complete({"--frames", "010::5"}).frame_step, 5U);
}

TEST(Flags, AWindowOfOneScanIsNoWindow)
{
	EXPECT_FALSE(complete({"--window", "1"}).window);
	EXPECT_EQ(complete({"--window", "10"}).window, 10);
}

TEST(Flags, AnEmptyValueIsRefusedExceptForALabel)
{
	EXPECT_EQ(complete({"--sensor-label", ""}).sensor_label, "");
	for (const std::string option :
	     {"--map", "--input", "--output", "--config", "--ground-truth", "--frames", "--threads", "--window", "--region",
	      "--time-budget", "--seed", "--plugins", "--motion", "--save-map", "--write-config", "--write-pf-ini",
	      "--index", "--resolution", "--origin"})
		for (const std::vector<std::string>& words : {std::vector{option, std::string()}, std::vector{option + "="}})
			EXPECT_EQ(refusal(words, parse).rfind(option + ": needs a value", 0), 0U) << refusal(words, parse);
}

TEST(Flags, ValuesThatMakeNoSenseAreRefused)
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
	    {{"--max-range", "0"}, "--max-range: '0' is not a range from 1.2e-38 to 3.4e+38 m"},
	    {{"--max-range", "-1"}, "--max-range: '-1' is not a range from 1.2e-38 to 3.4e+38 m"},
	    {{"--max-range", "1e-300"}, "--max-range: '1e-300' is not a range from 1.2e-38 to 3.4e+38 m"},
	    {{"--max-range", "1e300"}, "--max-range: '1e300' is not a range from 1.2e-38 to 3.4e+38 m"},
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

TEST(Flags, OnlyWritingAConfigurationNeedsNoMap)
{
	EXPECT_TRUE(parse({"--write-config", "all.ini"})->only_writes_config());
	EXPECT_THROW(parse({"-m", "a.yaml", "--write-config", "all.ini"}), UserError);
}

TEST(Flags, HelpAndVersionArePrintedWhateverElseIsThere)
{
	std::string printed;
	EXPECT_FALSE(parse_and_print({"--help"}, printed));
	EXPECT_EQ(printed.rfind("Usage: rawlog-localize", 0), 0U) << printed;
	EXPECT_FALSE(parse_and_print({"-m", "a.yaml", "--version"}, printed));
	EXPECT_EQ(printed.rfind("rawlog-localize (d2s1r) ", 0), 0U) << printed;
}
