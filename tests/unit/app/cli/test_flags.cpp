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
std::optional<Flags> parse(std::vector<std::string> words, std::string* printed = nullptr)
{
	words.insert(words.begin(), "rawlog-localize");
	std::vector<char*> pointers;
	for (auto& word : words) pointers.push_back(word.data());
	std::ostringstream out;
	const auto flags = parse_flags(static_cast<int>(pointers.size()), pointers.data(), out);
	if (printed) *printed = out.str();
	return flags;
}

/// Parses a complete command line with `more` at its end.
Flags complete(const std::vector<std::string>& more = {})
{
	std::vector<std::string> words = {"-m", "a.yaml", "-i", "b.rawlog", "-o", "out"};
	words.insert(words.end(), more.begin(), more.end());
	return parse(words).value();
}

/// Returns the message of the error that `more` leads to.
std::string refusal(const std::vector<std::string>& more)
{
	try
	{
		complete(more);
	}
	catch (const UserError& error)
	{
		EXPECT_EQ(error.status, kWrongUse);
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
	EXPECT_EQ(refusal({"--config", ""}).rfind("--config: needs a value", 0), 0U) << refusal({"--config", ""});
	EXPECT_EQ(refusal({"--config="}).rfind("--config: needs a value", 0), 0U) << refusal({"--config="});
}

TEST(Flags, EveryErrorNamesItsOptionAndTheHelp)
{
	const std::vector<std::pair<std::string, std::string>> wrong = {
	    {"--frames", "5"},        {"--frames", "7:3"},       {"--frames", "-1:3"},     {"--threads", "0"},
	    {"--threads", "257"},     {"--window", "0"},         {"--window", "many"},     {"--region", "1,2,3"},
	    {"--region", "0,0,0,1"},  {"--region", "0,0,inf,1"}, {"--seed", "-1"},         {"--time-budget", "0"},
	    {"--time-budget", "nan"}, {"--motion", "both"},      {"--origin", "1,2"},      {"--resolution", "0.05"},
	    {"--frames", "1:9:0"},    {"--threads", "2.5"},      {"--time-budget", "inf"}, {"--save-map", "map.png"},
	    {"--unknown", "1"}};
	for (const auto& [option, value] : wrong)
	{
		const std::string message = refusal({option, value});
		EXPECT_NE(message.find(option), std::string::npos) << message;
		EXPECT_NE(message.find("see rawlog-localize --help"), std::string::npos) << message;
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
	EXPECT_FALSE(parse({"--help"}, &printed));
	EXPECT_EQ(printed.rfind("Usage: rawlog-localize", 0), 0U) << printed;
	EXPECT_FALSE(parse({"-m", "a.yaml", "--version"}, &printed));
	EXPECT_EQ(printed.rfind("rawlog-localize (d2s1r) ", 0), 0U) << printed;
}
