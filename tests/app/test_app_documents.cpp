// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Man page and completion say what --help says.
#include <sstream>

#include "app_process.h"

using namespace d2s1r::test;

class AppDocuments : public AppTest
{
   protected:
	/// What --help says of each option, by its long name.
	struct Option
	{
		std::string spelled;  //!< "-m, --map MAP"
		std::string meaning;
	};

	std::vector<Option> options() const
	{
		std::vector<Option> all;
		for (const auto& line : lines_of(run({"--help"}).out))
		{
			const bool starts = line.rfind("  -", 0) == 0 || line.rfind("      --", 0) == 0;
			const bool continues = !all.empty() && line.rfind(std::string(29, ' '), 0) == 0;
			const bool is_heading = line.empty() || line.back() == ':';
			if (starts)
			{
				const auto gap = line.find("  ", line.find('-'));
				all.push_back(
				    {words_of(line.substr(0, gap)), gap == std::string::npos ? "" : words_of(line.substr(gap))});
			}
			else if (continues)
				all.back().meaning = words_of(all.back().meaning + " " + line);
			else if (!all.empty() && !is_heading)
				break;
		}
		return all;
	}

	/// Words with one blank between them.
	static std::string words_of(const std::string& text)
	{
		std::istringstream in(text);
		std::string joined;
		for (std::string word; in >> word;) joined += (joined.empty() ? "" : " ") + word;
		return joined;
	}

	/// The text of a man page without fonts and escapes.
	static std::string plain(std::string roff)
	{
		for (const char* mark : {"\\fB", "\\fI", "\\fR"})
			for (auto at = roff.find(mark); at != std::string::npos; at = roff.find(mark)) roff.erase(at, 3);
		for (auto at = roff.find("\\-"); at != std::string::npos; at = roff.find("\\-")) roff.erase(at, 1);
		return words_of(roff);
	}
};

TEST_F(AppDocuments, ManPageExplainsEveryOptionAsHelpDoes)
{
	const std::string page = plain(read_file(D2S1R_SOURCE_DIR "/share/man/man1/rawlog-localize.1"));
	ASSERT_GE(options().size(), 18U);
	for (const auto& option : options())
		EXPECT_NE(page.find(".TP " + option.spelled + " " + option.meaning), std::string::npos)
		    << option.spelled << " " << option.meaning;
}

TEST_F(AppDocuments, CompletionOffersEveryOption)
{
	const auto result = run_program(
	    {"bash", "-c",
	     "source " D2S1R_SOURCE_DIR
	     "/share/bash-completion/completions/rawlog-localize; COMP_WORDS=(rawlog-localize -); "
	     "COMP_CWORD=1; _rawlog_localize; echo \" ${COMPREPLY[*]} \""});
	ASSERT_EQ(result.status, 0) << result.err;
	for (const auto& option : options())
	{
		const auto start = option.spelled.find("--");
		const std::string name = option.spelled.substr(start, option.spelled.find(' ', start) - start);
		EXPECT_NE(result.out.find(" " + name + " "), std::string::npos) << name << " is not in " << result.out;
	}
}

TEST_F(AppDocuments, CompletionOffersFilesOfTheRightKind)
{
	for (const char* name : {"a.rawlog", "a.yaml", "a.txt", "b.rawlog.gz", "b.signaturemap"})
		write_file(path(name), "");
	const auto offered = [&](const std::string& option, const std::string& start)
	{
		return run_program({"bash", "-c",
		                    "source " D2S1R_SOURCE_DIR
		                    "/share/bash-completion/completions/rawlog-localize; COMP_WORDS=(x " +
		                        option + " " + start + "); COMP_CWORD=2; _rawlog_localize; echo \"${COMPREPLY[*]}\""})
		    .out;
	};
	EXPECT_EQ(offered("-i", path("a")), path("a.rawlog") + "\n");
	EXPECT_EQ(offered("--map", path("a")), path("a.yaml") + "\n");
	EXPECT_EQ(offered("--ground-truth", path("a")), path("a.txt") + "\n");
	EXPECT_EQ(offered("--input", path("b")), path("b.rawlog.gz") + "\n");
	EXPECT_EQ(offered("-m", path("b")), path("b.signaturemap") + "\n");
	EXPECT_EQ(offered("--motion", "o"), "odometry\n");
}

TEST_F(AppDocuments, TheLibrarysPageShowsTheExampleThatIsBuilt)
{
	const std::string page = read_file(D2S1R_SOURCE_DIR "/doc/library.md"),
	                  example = D2S1R_SOURCE_DIR "/share/d2s1r/examples/one_scan";
	EXPECT_NE(page.find("```cmake\n" + read_file(example + "/CMakeLists.txt") + "```"), std::string::npos);
	const std::string source = read_file(example + "/one_scan.cpp");
	EXPECT_NE(page.find("```cpp\n" + source.substr(source.find('\n') + 1) + "```"), std::string::npos);
}

TEST_F(AppDocuments, PagesNameOnlyOptionsAndFilesThatExist)
{
	const std::string help = run({"--help"}).out;
	for (const char* name : {"README.md", "doc/usage.md", "doc/library.md", "doc/atlas.md"})
	{
		const std::string page = read_file(std::string(D2S1R_SOURCE_DIR "/") + name);
		for (auto at = page.find("| `-"); at != std::string::npos; at = page.find("| `-", at + 1))
		{
			const auto start = page.find('-', at);
			const std::string option = page.substr(start, page.find_first_of(" `", start) - start);
			EXPECT_NE(help.find(option), std::string::npos) << name << ": " << option;
		}
		for (auto at = page.find("`share/"); at != std::string::npos; at = page.find("`share/", at + 1))
		{
			const std::string file = page.substr(at + 1, page.find_first_of("` ", at + 1) - at - 1);
			EXPECT_TRUE(std::filesystem::exists(std::filesystem::path(D2S1R_SOURCE_DIR) / file))
			    << name << ": " << file;
		}
	}
}
