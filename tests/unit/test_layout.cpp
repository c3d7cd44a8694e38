// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The folders of the library are the stages of its data flow, and no include runs back; folders can be surveyed; what
// doc/promises.md promises is tested.
#include <d2s1r/version.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace d2s1r::test
{
namespace
{
namespace fs = std::filesystem;

const fs::path kLibrary = fs::path(D2S1R_SOURCE_DIR) / "libs/d2s1r";
const fs::path kProgram = fs::path(D2S1R_SOURCE_DIR) / "apps/rawlog-localize";

constexpr const char* kTooManyInFolder = " has more files than a reader can survey; join small ones, or cut the folder";
constexpr const char* kTooMany =
    "these are more files than a reader can survey; join small ones, or raise this limit and say why";

/// The stages in their order; a file may include its own stage and those of a lower number. Stages of one number do not
/// know of each other.
const std::map<std::string, int> kStages = {
    {"base", 0},        {"scan", 1},   {"map", 2},  {"map_files", 3}, {"ranges", 3}, {"prior", 4},     {"answer", 5},
    {"calibration", 5}, {"coarse", 6}, {"fine", 7}, {"engine", 8},    {"paper", 8},  {"localizer", 9}, {"frames", 10}};

/// The stage of each public header that is not named like its folder.
const std::map<std::string, std::string> kStageOfHeader = {
    {"parameters.h", "base"},
    {"parameter_list.h", "base"},
    {"simd_targets.h", "base"},
    {"unusable_index.h", "base"},
    {"range_scan.h", "scan"},
    {"scan.h", "scan"},
    {"scan_defect.h", "scan"},
    {"scan_accumulator.h", "scan"},
    {"occupancy_map.h", "map"},
    {"grid.h", "map"},
    {"map_io.h", "map_files"},
    {"calibration.h", "calibration"},
    {"map_limits.h", "map"},
    {"map_stream.h", "map_files"},
    {"changed_map.h", "map_files"},
    {"lost_cells.h", "map_files"},
    {"likelihood_field.h", "frames"},
    {"localization.h", "answer"},
    {"fused_pose.h", "answer"},
    {"prior.h", "prior"},
    {"localizer.h", "localizer"},
    {"memory_to_build.h", "localizer"},
    {"allowed_cells.h", "localizer"},
    {"atlas.h", "localizer"},
    {"tracker.h", "frames"},
    {"map_names.h", "localizer"},
    {"window_localizer.h", "frames"},
    {"motion.h", "frames"},
    {"version.h", "base"}};

std::vector<fs::path> files_below(const fs::path& folder)
{
	std::vector<fs::path> files;
	for (const auto& entry : fs::recursive_directory_iterator(folder))
		if (entry.is_regular_file()) files.push_back(entry.path());
	return files;
}

/// The stage that an included file belongs to; empty if it is not of the library.
std::string stage_of(const std::string& included)
{
	const fs::path path(included);
	const std::string folder = path.parent_path().string();
	if (kStages.count(folder) > 0) return folder;
	const auto header = kStageOfHeader.find(path.filename().string());
	return header != kStageOfHeader.end() && (folder.empty() || folder == "d2s1r") ? header->second : "";
}

/// The stage of a source file: its folder, "localizer" for those beside the folders, and that of a public header.
std::string stage_of_file(const fs::path& file)
{
	if (file.parent_path().filename() == "d2s1r") return stage_of("d2s1r/" + file.filename().string());
	if (file.parent_path().filename() == "src") return "localizer";
	return file.parent_path().filename().string();
}

std::string text_of(const fs::path& file)
{
	std::ifstream stream(file);
	return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<std::string> includes_of(const fs::path& file)
{
	std::vector<std::string> included;
	std::ifstream stream(file);
	const std::string start = "#include ";
	for (std::string line; std::getline(stream, line);)
		if (line.rfind(start, 0) == 0)
			included.push_back(line.substr(start.size() + 1, line.find_last_of("\">") - start.size() - 1));
	return included;
}

std::vector<fs::path> sources()
{
	std::vector<fs::path> files = files_below(kLibrary / "src");
	for (const char* headers : {"include", "private"})
		for (const fs::path& header : files_below(kLibrary / headers)) files.push_back(header);
	return files;
}
}  // namespace

TEST(Layout, NoIncludeRunsAgainstTheDataFlow)
{
	int checked = 0;
	for (const fs::path& file : sources())
	{
		const std::string from = stage_of_file(file);
		ASSERT_EQ(kStages.count(from), 1U) << file << " has no stage in kStages or kStageOfHeader";
		for (const std::string& included : includes_of(file))
		{
			const std::string to = stage_of(included);
			if (to.empty() || to == from) continue;
			checked++;
			EXPECT_LT(kStages.at(to), kStages.at(from))
			    << file << " of stage " << from << " includes " << included << ", which is not of an earlier stage";
		}
	}
	EXPECT_GT(checked, 60) << "the test must see the includes";
}

TEST(Layout, FoldersCanBeSurveyed)
{
	std::map<std::string, int> files;
	for (const fs::path& file : files_below(kLibrary / "src")) files[file.parent_path().filename().string()]++;
	for (const auto& [folder, count] : files) EXPECT_LE(count, 15) << folder << kTooManyInFolder;
	// Six of them are the least squares of the calibration, where they start, and what they say; three are the state of
	// a tracker, where it looks at a scan and what it believes, which one file of 674 lines held; two are the shifts of
	// pieces of surface.
	EXPECT_LE(files_below(kLibrary / "src").size(), 124U) << kTooMany;
	// The calibration of the laser, and fused poses, which need no MRPT, are two of them.
	EXPECT_LE(files_below(kLibrary / "include").size() + 1, 18U) << "with version.h, which is generated: " << kTooMany;
}

TEST(Layout, FoldersOfTheProgramCanBeSurveyed)
{
	std::map<std::string, int> files;
	for (const fs::path& file : files_below(kProgram))
		if (file.parent_path() != kProgram) files[file.parent_path().filename().string()]++;
	int all = 0;
	for (const auto& [folder, count] : files)
	{
		EXPECT_LE(count, 15) << folder << kTooManyInFolder;
		all += count;
	}
	EXPECT_GT(all, 20) << "the test must see the files";
	EXPECT_LE(all, 80) << kTooMany;
}

/// Programs pick what they need, so that a header of several topics would hide which.
TEST(Layout, PrivateHeadersHaveOneTopicEach)
{
	constexpr std::size_t kMostDeclarations = 4;  // of functions, constants and types
	int checked = 0;
	for (const fs::path& header : files_below(kLibrary / "private"))
	{
		if (header.filename() == "parameter_list.h") continue;  // a function a section
		const std::string text = text_of(header);
		const std::regex declaration("\n(struct|class|enum class|\\[\\[noreturn|[A-Za-z_:<>, ]+&? [a-z_]+\\()");
		const auto count = std::distance(std::sregex_iterator(text.begin(), text.end(), declaration), {});
		EXPECT_LE(static_cast<std::size_t>(count), kMostDeclarations)
		    << header << " has several topics; cut it by topic";
		checked++;
	}
	EXPECT_GT(checked, 5) << "the test must see the headers";
}

/// GCC 12.2 crashes on SVE, and a struct cannot hold its vectors.
TEST(Layout, NoSourceIsCompiledForSve)
{
	const std::string targets = text_of(kLibrary / "src/base/simd.h");
	for (const char* sve : {"HWY_SVE ", "HWY_SVE2 ", "HWY_SVE_256 ", "HWY_SVE2_128)"})
		EXPECT_NE(targets.find(sve, targets.find("#define HWY_DISABLED_TARGETS (")), std::string::npos) << sve;
	int checked = 0;
	for (const fs::path& file : files_below(kLibrary / "src"))
	{
		const std::string text = text_of(file);
		const auto compiled = text.find("#include <hwy/foreach_target.h>");
		if (compiled == std::string::npos) continue;
		checked++;
		EXPECT_LT(text.find("#include \"base/simd.h\""), compiled)
		    << file << " must include base/simd.h before it is compiled for each target";
		EXPECT_EQ(text.find("define HWY_DISABLED_TARGETS"), std::string::npos) << file << " enables SVE again";
	}
	EXPECT_GE(checked, 6) << "the test must see the sources";
}

/// Files end up at the top by mistake, as the output of a run does.
TEST(Layout, EveryNameAtTheTopHasAPurpose)
{
	const fs::path project(D2S1R_SOURCE_DIR);
	if (!fs::exists(project / ".git")) GTEST_SKIP() << "only git knows which files belong to the project";
	const std::string command = "git -C '" + project.string() + "' ls-files";
	const std::unique_ptr<FILE, int (*)(FILE*)> names(popen(command.c_str(), "r"), pclose);
	std::set<std::string> at_the_top;
	for (std::array<char, 4096> line{}; names && std::fgets(line.data(), line.size(), names.get());)
	{
		const std::string name = line.data();
		at_the_top.insert(name.substr(0, name.find_first_of("/\n")));
	}
	ASSERT_GT(at_the_top.size(), 20U) << "the test must see the names";
	const std::set<std::string> known = {
	    ".ci",
	    ".clang-format",
	    ".clang-tidy",
	    ".dockerignore",
	    ".editorconfig",
	    ".github",
	    ".gitignore",
	    ".pre-commit-config.yaml",
	    "CMakeLists.txt",
	    "CMakePresets.json",
	    "demo.sh",
	    "dependencies.txt",
	    "experiments",
	    "package.xml",
	    "pyproject.toml",
	    "scripts",
	    "setup.py",
	    "test.sh"};
	const std::string build = text_of(project / "CMakeLists.txt");
	for (const std::string& name : at_the_top)
		EXPECT_TRUE(known.count(name) > 0 || build.find(name) != std::string::npos)
		    << name << " is neither built nor installed by CMakeLists.txt, nor known to this test";
}

TEST(Version, IsTheSameInEveryFile)
{
	const fs::path project(D2S1R_SOURCE_DIR);
	const std::string version = D2S1R_VERSION;
	EXPECT_NE(text_of(project / "package.xml").find("<version>" + version + "</version>"), std::string::npos);
	EXPECT_NE(text_of(project / "CITATION.cff").find("\nversion: " + version + "\n"), std::string::npos);
	EXPECT_EQ(text_of(project / "packaging/debian/changelog").find("d2s1r (" + version + "-"), 0U);
	const std::string changes = text_of(project / "CHANGELOG.md");
	EXPECT_EQ(changes.find("## [" + version + "]"), changes.find("## ["))
	    << "CHANGELOG.md must begin with the version " << version
	    << " that CMakeLists.txt names; it has no [Unreleased]";
}

/// A promise without a test would be a wish.
TEST(Promises, AreKeptByTestsThatExist)
{
	const fs::path project(D2S1R_SOURCE_DIR);
	std::string tests;
	for (const fs::path& file : files_below(project / "tests"))
		if (file.extension() == ".cpp" || file.filename() == "CMakeLists.txt") tests += text_of(file);
	const std::string promises = text_of(project / "doc/promises.md");
	int checked = 0;
	std::istringstream parts(promises);
	bool is_code = false;  // every second part between backticks
	for (std::string part; std::getline(parts, part, '`'); is_code = !is_code)
	{
		const auto dot = part.find('.');
		const bool is_name =
		    part.find_first_of(" /-\n()") == std::string::npos && part.find('.', dot + 1) > part.size();
		if (!is_code || dot == std::string::npos || !is_name) continue;
		const std::string suite = part.substr(0, dot), test = part.substr(dot + 1);
		if (suite != "fuzz" && (suite.empty() || std::islower(static_cast<unsigned char>(suite[0]))))
			continue;  // a file
		const std::string built = suite == "fuzz" ? "d2s1r_add_fuzz_target(" + test : "(" + suite + ", " + test + ")";
		EXPECT_NE(tests.find(built), std::string::npos)
		    << "doc/promises.md names " << suite << "." << test << ", which does not exist";
		checked++;
	}
	EXPECT_GT(checked, 40) << "the test must see the names";
}
}  // namespace d2s1r::test
