// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <base/output_file.h>

#include "app/temporary_folder.h"

using namespace d2s1r;
namespace fs = std::filesystem;

class OutputFile : public d2s1r::test::FolderTest
{
};

TEST_F(OutputFile, AppearsUnderItsNameOnlyWhenItIsWhole)
{
	write("a.txt", "old");
	TextFile file(path("a.txt"));
	file.print("%s %d\n", "new", 1);
	EXPECT_EQ(read("a.txt"), "old");
	EXPECT_EQ(count(), 2);
	file.commit();
	EXPECT_EQ(read("a.txt"), "new 1\n");
	EXPECT_EQ(count(), 1);
}

TEST_F(OutputFile, LeavesNothingIfItIsNotCommitted)
{
	{
		TextFile text(path("a.txt"));
		text.print("half");
		EXPECT_EQ(count(), 1);
	}
	EXPECT_EQ(count(), 0);
}

TEST_F(OutputFile, AdviceFitsTheErrorOfTheSystem)
{
	const auto message_of = [](const std::string& file)
	{
		try
		{
			TextFile text(file);
		}
		catch (const OutputError& error)
		{
			return std::string(error.what());
		}
		return std::string();
	};
	const std::string missing = message_of(path("none/a.txt"));
	EXPECT_NE(missing.find("(No such file or directory); check the path"), std::string::npos) << missing;
	write("file.txt", "");
	const std::string through_file = message_of(path("file.txt/a.txt"));
	EXPECT_NE(through_file.find("; check the path"), std::string::npos) << through_file;
}

TEST_F(OutputFile, IsWrittenWhereLinksLead)
{
	fs::create_directory(path("elsewhere"));
	fs::create_symlink("elsewhere/b.txt", path("a.txt"));
	TextFile file(path("a.txt"));
	file.print("text");
	file.commit();
	EXPECT_TRUE(fs::is_symlink(path("a.txt")));
	EXPECT_EQ(read("elsewhere/b.txt"), "text");
}

TEST_F(OutputFile, FoldersDevicesAndMissingFoldersAreRefused)
{
	for (const std::string& name : {path(""), std::string("/dev/null"), path("missing/a.txt")}) try
		{
			TextFile file(name);
			ADD_FAILURE() << name;
		}
		catch (const OutputError& error)
		{
			EXPECT_EQ(std::string(error.what()).rfind(name + ": ", 0), 0U) << error.what();
		}
}
