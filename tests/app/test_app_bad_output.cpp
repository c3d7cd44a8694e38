// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Outputs that cannot be written: one line, exit status 3, nothing half-written under its name.

#include <set>

#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;
namespace fs = std::filesystem;

class AppBadOutput : public AppTest
{
   protected:
	AppBadOutput()
	{
		save_map(flat(), path("flat.yaml"));
		save(observation_log(), path("walk.rawlog"));
	}

	void expect_bad_folder(const std::string& folder) const
	{
		expect_refusal({"-m", path("flat.yaml"), "-i", path("walk.rawlog"), "-o", folder}, 3, {folder});
	}
};

TEST_F(AppBadOutput, OutputFolderThatCannotBeMade)
{
	write_file(path("file"), "");
	expect_bad_folder(path("file"));
	expect_bad_folder(path("file") + "/below");
	expect_bad_folder("/proc/d2s1r");
}

TEST_F(AppBadOutput, OutputFolderThatMayNotBeMade)
{
	fs::create_directory(path("locked"));
	fs::permissions(path("locked"), fs::perms::none);
	expect_refused(
	    run_as_ordinary_user({"-m", path("flat.yaml"), "-i", path("walk.rawlog"), "-o", path("locked/out")}), 3,
	    {path("locked/out") + ": cannot be made (Permission denied)"});
}

TEST_F(AppBadOutput, OutputFolderWithAFolderInTheWayOfAFile)
{
	fs::create_directories(path("out/map.png/full"));
	const auto result = run({"-m", path("flat.yaml"), "-i", path("walk.rawlog"), "-o", path("out"), "-q"});
	EXPECT_EQ(result.status, 3);
	EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
	EXPECT_NE(result.err.find("map.png"), std::string::npos) << result.err;
}

TEST_F(AppBadOutput, DiskThatFillsUpAtAnyFile)
{
	std::set<std::string> failed;
	for (const std::string option : {" -q", " --no-rawlog -q"})  // localized.rawlog is the largest file
		for (int size = 1; size <= 4096; size *= 2)              // [KiB] that any file may have
		{
			fs::remove_all(path("out"));
			const std::string command = "trap '' XFSZ; ulimit -f " + std::to_string(size) +
			                            "; exec " RAWLOG_LOCALIZE " -m " + path("flat.yaml") + " -i " +
			                            path("walk.rawlog") + " -o " + path("out") + option;
			const auto result = run_program({"bash", "-c", command});
			if (result.status == 0) break;
			EXPECT_EQ(result.status, 3) << result.err;
			EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
			const auto end = result.err.find(": cannot be written");
			const fs::path file = result.err.substr(0, end).substr(std::string("rawlog-localize: ").size());
			EXPECT_FALSE(fs::exists(file)) << file;
			failed.insert(file.filename());
		}
	EXPECT_TRUE(fs::exists(path("out/scene.3Dscene")));
	for (const char* name : {"localized.rawlog", "map.png"}) EXPECT_EQ(failed.count(name), 1U) << name;
}

TEST_F(AppBadOutput, DiskThatFillsUpAtAnyFileOfThePipeline)
{
	std::set<std::string> failed;
	int status = 3;
	for (int pages = 1; pages <= 32 && status != 0; pages++)
	{
		fs::create_directories(path("small"));
		const std::string command = mrpt::format(
		    "mount -t tmpfs -o size=%dk tmpfs %s || exit 77; " RAWLOG_LOCALIZE
		    " -q -m %s -i %s -o %s --write-pf-ini %s/pf.ini; status=$?; cp -a %s %s; exit $status",
		    4 * pages, path("small").c_str(), path("flat.yaml").c_str(), path("walk.rawlog").c_str(),
		    path("out").c_str(), path("small").c_str(), path("small").c_str(), path("copy").c_str());
		fs::remove_all(path("copy"));
		const auto result = run_program({"unshare", "--map-root-user", "--mount", "bash", "-c", command});
		if (result.status == 77 || result.status == 127 || result.err.rfind("unshare: ", 0) == 0)
			GTEST_SKIP() << "no small disk to be had: " << result.err;
		status = result.status;
		if (status == 0) break;
		EXPECT_EQ(status, 3) << result.err;
		EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
		const auto end = result.err.find(": cannot be written");
		const fs::path file = result.err.substr(0, end).substr(std::string("rawlog-localize: ").size());
		EXPECT_FALSE(fs::exists(path("copy") / file.filename())) << file;
		failed.insert(file.filename());
	}
	EXPECT_EQ(status, 0);
	EXPECT_EQ(failed, (std::set<std::string>{"pf.rawlog", "pf.gridmap.gz", "pf.ini"}));
	EXPECT_EQ(load(path("copy/pf.rawlog")).size(), 2 * walk().size());
}

TEST_F(AppBadOutput, OnlyFilesAreReplaced)
{
	ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
	fs::create_directory(path("folder"));
	fs::create_symlink("pipe", path("link"));
	fs::create_symlink("loop", path("loop"));
	for (const char* name : {"pipe", "folder", "link"})
		expect_refusal({"--write-config", path(name)}, 3, {path(name) + ": is a folder, a device or a pipe"});
	expect_refusal({"--write-config", path("loop")}, 3, {path("loop") + ": cannot be written (Too many levels"});
	EXPECT_TRUE(fs::is_fifo(fs::symlink_status(path("pipe"))));
	EXPECT_TRUE(fs::is_symlink(path("link")));
}

TEST_F(AppBadOutput, WhereTheMessagesGoIsNotReplaced)
{
	write_file(path("log"), "kept\n");
	const std::string command = RAWLOG_LOCALIZE " --write-config /dev/stdout >> " + path("log");
	expect_refused(run_program({"bash", "-c", command}), 3, {"/dev/stdout: is where the messages go"});
	EXPECT_EQ(read_file(path("log")), "kept\n");
}

TEST_F(AppBadOutput, AFileThatMayNotGrowIsNamed)
{
	const std::string command = "ulimit -f 1; " RAWLOG_LOCALIZE " -q -m " + path("flat.yaml") + " -i " +
	                            path("walk.rawlog") + " -o " + path("out");
	expect_refused(run_program({"bash", "-c", command}), 3, {path("out"), "File too large"});
	EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(AppBadOutput, LinksStayAndTheirTargetsAreReplaced)
{
	fs::create_directory(path("elsewhere"));
	write_file(path("elsewhere/old.ini"), "old");
	fs::create_symlink("elsewhere/old.ini", path("to_old.ini"));
	fs::create_symlink(path("to_old.ini"), path("to_link.ini"));
	fs::create_symlink("elsewhere/new.ini", path("to_new.ini"));
	for (const char* link : {"to_link.ini", "to_new.ini"})
	{
		EXPECT_EQ(run({"--write-config", path(link)}).status, 0);
		EXPECT_TRUE(fs::is_symlink(path(link)));
	}
	EXPECT_TRUE(fs::is_symlink(path("to_old.ini")));
	for (const char* target : {"elsewhere/old.ini", "elsewhere/new.ini"})
		EXPECT_NE(read_file(path(target)).find("[localizer]"), std::string::npos) << target;
}

TEST_F(AppBadOutput, StandardOutputThatTakesNothing)
{
	const std::string command =
	    RAWLOG_LOCALIZE " -m " + path("flat.yaml") + " -i " + path("walk.rawlog") + " -o " + path("out");
	for (const std::string redirection : {" > /dev/full", " >&-", " -q > /dev/full"})
	{
		fs::remove_all(path("out"));
		const auto result = run_program({"bash", "-c", command + redirection});
		const bool is_quiet = redirection.find("-q") != std::string::npos;
		if (is_quiet)
			EXPECT_EQ(result.status, 0) << result.err;
		else
			expect_refused(result, 3, {"standard output: cannot be written"});
		EXPECT_EQ(lines_of(read_file(path("out/frames.csv"))).size(), walk().size() + 1);
		EXPECT_TRUE(fs::exists(path("out/scene.3Dscene")));
	}
	expect_refused(
	    run_program({"bash", "-c", RAWLOG_LOCALIZE " --help > /dev/full"}), 3, {"standard output: cannot be written"});
}

TEST_F(AppBadOutput, PipesThatNobodyReadsCostNoResults)
{
	const std::string start = pipe_that_nobody_reads() + "exec ";
	const std::string command =
	    RAWLOG_LOCALIZE " -m " + path("flat.yaml") + " -i " + path("walk.rawlog") + " -o " + path("out");
	for (const auto& [redirection, status] : {std::pair(" >&4", 3), {" 2>&4", 0}, {" >&4 2>&1", 3}})
	{
		fs::remove_all(path("out"));
		const auto result = run_program({"bash", "-c", start + command + redirection});
		EXPECT_EQ(result.status, status) << redirection;
		const bool is_told = redirection == std::string(" >&4");
		EXPECT_EQ(result.err.find("standard output: cannot be written") != std::string::npos, is_told) << result.err;
		EXPECT_EQ(lines_of(read_file(path("out/frames.csv"))).size(), walk().size() + 1);
		EXPECT_TRUE(fs::exists(path("out/summary.json")));
	}
	const std::string wrong = start + RAWLOG_LOCALIZE " --nothing 2>&4";
	EXPECT_EQ(run_program({"bash", "-c", wrong}).status, 1);
}

TEST_F(AppBadOutput, AReaderThatHasEnoughOfTheHelpIsNoError)
{
	for (const char* request : {" --help", " --version"})
	{
		const auto result = run_program({"bash", "-c", pipe_that_nobody_reads() + RAWLOG_LOCALIZE + request + " >&4"});
		EXPECT_EQ(result.status, 0) << request;
		EXPECT_EQ(result.err, "") << request;
	}
}

TEST_F(AppBadOutput, ConfigThatCannotBeWritten)
{
	expect_refusal({"--write-config", path("no/folder/all.ini")}, 3, {path("no/folder/all.ini")});
}
