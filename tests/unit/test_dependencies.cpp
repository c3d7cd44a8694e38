// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Includes run one way, base -> d2s1r -> ros -> {logs, live} -> shell -> programs, and libraries know nothing of
// programs.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace d2s1r::test
{
namespace
{
namespace fs = std::filesystem;

const fs::path kProject = D2S1R_SOURCE_DIR;

/// What a part of the project may include; it may include itself, too.
const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"libs/base", {}},
    {"libs/d2s1r", {"libs/base"}},
    {"libs/mrpt", {"libs/base", "libs/d2s1r"}},
    {"libs/ros", {"libs/base", "libs/d2s1r"}},
    {"libs/logs", {"libs/base", "libs/d2s1r", "libs/mrpt", "libs/ros"}},
    {"libs/live", {"libs/base", "libs/d2s1r", "libs/ros"}},
    {"plugins/pf-init", {"libs/base", "libs/d2s1r", "libs/mrpt"}},
    {"python", {"libs/base", "libs/d2s1r"}},
    {"apps/shell", {"libs/base", "libs/ros", "libs/d2s1r"}},
    {"apps/d2s1r-live", {"libs/base", "libs/ros", "libs/d2s1r", "libs/live", "apps/shell"}},
    {"apps/d2s1r-live-drive", {"libs/base", "libs/ros", "libs/d2s1r", "libs/live", "apps/shell", "apps/d2s1r-live"}},
    {"apps/d2s1r-live-ros1", {"libs/base", "libs/ros", "libs/d2s1r", "libs/live"}},
    {"apps/rawlog-localize", {"libs/base", "libs/ros", "libs/logs", "libs/d2s1r", "libs/mrpt", "apps/shell"}}};

bool is_source(const fs::path& file)
{
	return file.extension() == ".h" || file.extension() == ".cpp" || file.extension() == ".inc";
}

std::vector<fs::path> sources_below(const fs::path& folder)
{
	std::vector<fs::path> files;
	if (!fs::exists(folder)) return files;
	for (const auto& entry : fs::recursive_directory_iterator(folder))
		if (entry.is_regular_file() && is_source(entry.path())) files.push_back(entry.path());
	return files;
}

std::string source_text(const fs::path& file)
{
	std::ifstream stream(file);
	return {std::istreambuf_iterator<char>(stream), {}};
}

/// Returns the parts of the project that have sources.
std::vector<std::string> parts_of_project()
{
	std::vector<std::string> found;
	for (const char* folder : {"libs", "plugins", "apps"})
		for (const auto& entry : fs::directory_iterator(kProject / folder))
			if (entry.is_directory() && !sources_below(entry.path()).empty())
				found.push_back(folder + ("/" + entry.path().filename().string()));
	found.emplace_back("python");
	return found;
}

/// Returns the folders of a part that its includes start from.
std::vector<fs::path> roots_of(const std::string& part)
{
	const fs::path folder = kProject / part;
	return {folder / "include", folder / "src", folder};
}

/// Returns the part that an include of a file of `from` leads to; no value if it is of none.
std::optional<std::string> part_of(const std::string& included, const fs::path& file, const std::string& from)
{
	if (fs::is_regular_file(file.parent_path() / included)) return from;
	std::vector<std::string> order = {from};
	static const auto kParts = parts_of_project();
	order.insert(order.end(), kParts.begin(), kParts.end());
	for (const std::string& part : order)
		for (const fs::path& root : roots_of(part))
			if (fs::is_regular_file(root / included)) return part;
	return std::nullopt;
}

std::vector<std::string> includes_in(const fs::path& file)
{
	const std::string text = source_text(file);
	const std::regex include("#include [<\"]([^>\"]+)[>\"]");
	std::vector<std::string> found;
	for (std::sregex_iterator i(text.begin(), text.end(), include), end; i != end; ++i) found.push_back((*i)[1]);
	return found;
}

/// Returns the long names of the options of all programs, "--map".
std::set<std::string> options_of_programs()
{
	const std::regex option("\"(?:-[a-zA-Z],)?(--[a-z][a-z-]+)\"");
	std::set<std::string> found;
	for (const fs::path& file : sources_below(kProject / "apps"))
	{
		const std::string text = source_text(file);
		for (std::sregex_iterator i(text.begin(), text.end(), option), end; i != end; ++i) found.insert((*i)[1]);
	}
	return found;
}
}  // namespace

TEST(Dependencies, PartsIncludeOnlyWhatTheyStandOn)
{
	int checked = 0;
	for (const std::string& from : parts_of_project())
	{
		ASSERT_EQ(kMayInclude.count(from), 1U) << from << " has no place among the parts of the project";
		for (const fs::path& file : sources_below(kProject / from))
			for (const std::string& included : includes_in(file))
			{
				const auto to = part_of(included, file, from);
				if (!to || *to == from) continue;
				checked++;
				EXPECT_EQ(kMayInclude.at(from).count(*to), 1U)
				    << file << " includes " << included << " of " << *to << ", which kMayInclude does not allow";
			}
	}
	EXPECT_GT(checked, 60) << "the test must see the includes";
}

/// A robot carries MRPT's poses and math, and nothing that draws or reads images.
TEST(Dependencies, WhatARobotCarriesIncludesNoLargeLibraryOfMrpt)
{
	const std::regex large("mrpt/(obs|maps|img|config|opengl|viz|io|slam|vision|gui|hwdrivers)/.*");
	int checked = 0;
	for (const char* part :
	     {"libs/base", "libs/d2s1r", "libs/ros", "libs/live", "apps/shell", "apps/d2s1r-live", "apps/d2s1r-live-ros1",
	      "python"})
		for (const fs::path& file : sources_below(kProject / part))
			for (const std::string& included : includes_in(file))
			{
				checked += included.rfind("mrpt/", 0) == 0 ? 1 : 0;
				EXPECT_FALSE(std::regex_match(included, large))
				    << file << " includes " << included << "; what needs it belongs into libs/mrpt or libs/logs";
			}
	EXPECT_GT(checked, 40) << "the test must see the includes";
}

TEST(Dependencies, NoLibraryNamesAnOptionOfAProgram)
{
	const auto options = options_of_programs();
	ASSERT_GE(options.size(), 25U) << "the test must see the options";
	const std::regex word("--[a-z][a-z-]+");
	for (const fs::path& file : sources_below(kProject / "libs"))
	{
		const std::string text = source_text(file);
		for (std::sregex_iterator i(text.begin(), text.end(), word), end; i != end; ++i)
			EXPECT_EQ(options.count(i->str()), 0U)
			    << file << " names " << i->str() << ", an option of a program; let the program pass this text";
	}
}
}  // namespace d2s1r::test
