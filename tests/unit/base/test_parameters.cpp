// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/parameter_list.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <regex>
#include <set>
#include <stdexcept>

namespace d2s1r
{
namespace
{
/// The message of the std::invalid_argument that reading `ini` throws; empty if it throws none.
std::string refusal(const std::string& ini)
{
	try
	{
		parse_parameters(ini, "my.ini");
	}
	catch (const std::invalid_argument& error)
	{
		return error.what();
	}
	return {};
}

void expect_equal(const Parameters& a, const Parameters& b)
{
	EXPECT_EQ(a.method, b.method);
	EXPECT_EQ(to_ini(a), to_ini(b));
}

/// Every parameter at its greatest (or least) value.
Parameters at_limit(bool greatest)
{
	Parameters parameters;
	parameters.method = Method::kPaper;
	visit_parameters(
	    parameters, [&](const char*, const char*, auto& value, auto low, auto high, const char*)
	    { value = static_cast<std::decay_t<decltype(value)>>(greatest ? high : low); });
	return parameters;
}
}  // namespace

TEST(Parameters, TextsSetThemOneByOne)
{
	const Parameters set = with_settings({}, {"scan.no_return=1", "localizer.method=paper", "scan.no_return=0.5"});
	EXPECT_EQ(to_ini(set), to_ini(parse_parameters("[localizer]\nmethod = paper\n[scan]\nno_return = 0.5\n")));
	for (const auto& [setting, reason] :
	     {std::pair("no_return=1", "'no_return=1' is not of the form SECTION.KEY=VALUE"),
	      {"scan.no_return", "is not of the form"},
	      {"scan.no_retrun=1", "did you mean scan.no_return?"},
	      {"scan.no_return=often", "scan.no_return"}})
		try
		{
			with_settings({}, {setting});
			ADD_FAILURE() << setting;
		}
		catch (const std::invalid_argument& error)
		{
			EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
		}
}

/// A field that the list lacks could not be read from an ini file, nor checked, nor told.
TEST(Parameters, TheListHoldsEveryField)
{
	std::ifstream header(D2S1R_SOURCE_DIR "/libs/d2s1r/include/d2s1r/parameters.h");
	const std::regex field("\t(?:double|int|bool) (\\w+) = .*");
	std::multiset<std::string> declared, listed;
	std::smatch match;
	for (std::string line; std::getline(header, line) && line != "struct LikelihoodParameters";)
		if (std::regex_match(line, match, field)) declared.insert(match[1]);
	Parameters parameters;
	visit_parameters(
	    parameters, [&](const char*, const char* name, auto&, auto, auto, const char*) { listed.insert(name); });
	EXPECT_EQ(declared, listed) << "enter it in base/parameter_list.h";
}

TEST(Parameters, EmptyTextGivesTheDefaults)
{
	expect_equal(parse_parameters(""), Parameters{});
	expect_equal(parse_parameters("; a comment\n\n[grid]\n"), Parameters{});
}

TEST(Parameters, ReadsEveryKindOfValue)
{
	const Parameters p = parse_parameters(
	    "[localizer]\nmethod = paper ; as published\r\n"
	    "[grid]\n  occupied_threshold=7e-1 // comment\n[free_cells]\nlargest_region_only = true # comment\n"
	    "[paper]\nbins = 30\n");
	EXPECT_EQ(p.method, Method::kPaper);
	EXPECT_DOUBLE_EQ(p.grid.occupied_threshold, 0.7);
	EXPECT_TRUE(p.free_cells.largest_region_only);
	EXPECT_EQ(p.paper.bins, 30);
}

TEST(Parameters, WhatIsWrittenReadsBackTheSame)
{
	Parameters parameters;
	parameters.grid.simplemap_cell_size = 0.1 / 3;
	parameters.paper.epsilon = 1.2345678901234567e-5;
	const Parameters back = parse_parameters(to_ini(parameters));
	EXPECT_EQ(back.grid.simplemap_cell_size, parameters.grid.simplemap_cell_size);
	EXPECT_EQ(back.paper.epsilon, parameters.paper.epsilon);
	expect_equal(back, parameters);
	expect_equal(parse_parameters(to_ini(at_limit(true))), at_limit(true));
	expect_equal(parse_parameters(to_ini(at_limit(false))), at_limit(false));
}

TEST(Parameters, WrittenFileNamesEveryParameterWithItsMeaning)
{
	const Parameters parameters;
	const std::string ini = to_ini(parameters);
	EXPECT_NE(ini.find("method = default"), std::string::npos);
	visit_parameters(
	    parameters,
	    [&](const char* section, const char* key, auto, auto, auto, const char* meaning)
	    {
		    EXPECT_NE(ini.find('[' + std::string(section) + "]\n"), std::string::npos) << section;
		    EXPECT_NE(ini.find('\n' + std::string(key) + " = "), std::string::npos) << key;
		    EXPECT_NE(ini.find(meaning), std::string::npos) << meaning;
	    });
}

TEST(Parameters, DefaultWeightsAreThoseThatLearnPyWrote)
{
	const std::string file = D2S1R_SOURCE_DIR "/experiments/results/learned/learned.ini";
	const Parameters defaults;
	EXPECT_EQ(to_ini(load_parameters(file)), to_ini(defaults));
	std::ifstream stream(file);
	const std::string text(std::istreambuf_iterator<char>(stream), {});
	visit_parameters(
	    defaults,
	    [&](const std::string& section, const std::string& key, auto, auto, auto, const char*)
	    {
		    const bool is_learned =
		        section == "beam_model" || section == "presence_model" || key.rfind("temperature", 0) == 0;
		    EXPECT_EQ(text.find('\n' + key + " = ") != std::string::npos, is_learned) << section << '.' << key;
	    });
}

TEST(Parameters, UnknownNamesAreRefused)
{
	EXPECT_EQ(
	    refusal("[grid]\nocupied_threshold = 0.5\n"),
	    "my.ini:2: grid.ocupied_threshold is not a parameter; did you mean grid.occupied_threshold?");
	EXPECT_NE(refusal("[gird]\nfree_threshold = 0.5\n").find("did you mean grid.free_threshold?"), std::string::npos);
	EXPECT_NE(refusal("[grid]\nmin_beams = 5\n").find("did you mean scan.min_beams?"), std::string::npos)
	    << "another section";
	EXPECT_EQ(
	    refusal("[grid]\ncolour = 5\n"), "my.ini:2: grid.colour is not a parameter; remove it or correct its name");
	EXPECT_NE(
	    refusal("[gird]\noccupied_threshold = 0.5\n").find("my.ini:2: gird.occupied_threshold"), std::string::npos);
	EXPECT_EQ(
	    refusal("occupied_threshold = 0.5\n"),
	    "my.ini:1: 'occupied_threshold = 0.5' stands before the first [section]; put it below the one it belongs to");
}

TEST(Parameters, TextThatIsNotAValueIsRefused)
{
	EXPECT_EQ(refusal("[paper]\nbins = abc\n"), "my.ini:2: paper.bins = 'abc': expected a whole number");
	for (const char* text : {"1.5", "", "0x10", "60 bins", "99999999999"})
		EXPECT_NE(refusal("[paper]\nbins = " + std::string(text) + "\n"), "") << text;
	for (const char* text : {"0,65", "abc", "0.5.5", "nan", "inf", "1e999"})
		EXPECT_NE(refusal("[grid]\noccupied_threshold = " + std::string(text) + "\n"), "") << text;
	for (const char* text : {"maybe", "2", "TRUE!"})
		EXPECT_NE(refusal("[free_cells]\nlargest_region_only = " + std::string(text) + "\n"), "") << text;
	EXPECT_NE(refusal("[localizer]\nmethod = papers\n").find("expected default or paper"), std::string::npos);
}

TEST(Parameters, ValuesOutOfRangeAreRefused)
{
	EXPECT_EQ(refusal("[paper]\nbins = 1\n"), "my.ini:2: paper.bins = '1': expected a value from 2 to 256");
	EXPECT_NE(refusal("[grid]\nfree_threshold = -0.1\n").find("from 0 to 1"), std::string::npos);
	EXPECT_NE(refusal("[grid]\nfree_threshold = 0.9\n").find("my.ini: grid.free_threshold"), std::string::npos);
}

TEST(Parameters, MalformedLinesAreRefused)
{
	EXPECT_NE(refusal("[paper]\nbins 60\n").find("my.ini:2: 'bins 60' is neither"), std::string::npos);
	EXPECT_NE(refusal("[paper]\nbins 60\n").find("; correct or remove the line"), std::string::npos);
	EXPECT_NE(refusal("[paper\nbins = 60\n").find("my.ini:1: "), std::string::npos);
	EXPECT_NE(
	    refusal("[paper]\nbins = 60\nbins = 61\n").find("my.ini:3: paper.bins is given twice"), std::string::npos);
}

TEST(Parameters, MessagesHoldPrintableTextOnly)
{
	const std::string bytes = std::string("\0\x1B\xE4\x7F", 4) + std::string(500, 'x');
	for (const std::string& ini : {bytes, "[paper]\nbins = " + bytes, bytes + " = 1", "[" + bytes + "]\na = 1\na = 2"})
	{
		const std::string message = refusal(ini);
		EXPECT_NE(message.find("????xxx"), std::string::npos) << message;
		EXPECT_NE(message.find("xxx..."), std::string::npos) << message;
		EXPECT_LT(message.size(), 200U);
	}
}

TEST(Parameters, CheckNamesTheFirstValueOutOfRange)
{
	Parameters parameters;
	EXPECT_NO_THROW(check(parameters));
	parameters.scan.max_tilt = std::numeric_limits<double>::quiet_NaN();
	try
	{
		check(parameters);
		FAIL();
	}
	catch (const std::invalid_argument& error)
	{
		EXPECT_NE(std::string(error.what()).find("scan.max_tilt"), std::string::npos) << error.what();
	}
}

TEST(Parameters, ByteOrderMarkIsSkipped)
{
	EXPECT_EQ(parse_parameters("\xEF\xBB\xBF[paper]\nbins = 33\n").paper.bins, 33);
}

TEST(Parameters, LinesMayEndWithAnything)
{
	for (const std::string end : {"\n", "\r\n", "\r"})
		EXPECT_EQ(parse_parameters("; first" + end + "[paper]" + end + "bins = 33" + end).paper.bins, 33);
	EXPECT_THROW(parse_parameters("; first\r[paper]\rbins = few\n"), std::invalid_argument);
}

TEST(Parameters, FilesThatCannotBeReadToTheirEndAreRefused)
{
	const auto refusal_of = [](const std::string& file)
	{
		try
		{
			load_parameters(file);
		}
		catch (const std::runtime_error& error)
		{
			return std::string(error.what());
		}
		return std::string();
	};
	EXPECT_NE(refusal_of("/proc/self/mem").find("/proc/self/mem: cannot be read ("), std::string::npos);
	EXPECT_NE(refusal_of("/dev/zero").find("/dev/zero: is longer than"), std::string::npos);
}

TEST(Parameters, FilesAreReadAndMissingOnesNamed)
{
	const auto file = std::filesystem::temp_directory_path() / "d2s1r_test_parameters.ini";
	std::ofstream(file) << "[paper]\nbins = 33\n";
	EXPECT_EQ(load_parameters(file.string()).paper.bins, 33);
	std::filesystem::remove(file);
	for (const std::string& bad : {file.string(), std::filesystem::temp_directory_path().string()}) try
		{
			load_parameters(bad);
			FAIL() << bad;
		}
		catch (const std::runtime_error& error)
		{
			EXPECT_EQ(std::string(error.what()).find(bad), 0U) << error.what();
		}
}
}  // namespace d2s1r
