// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The files of a run appear together or not at all, whatever ends it, and nothing of an earlier run is left.
#include <nlohmann/json.hpp>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <map>
#include <set>
#include <thread>

#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;
namespace fs = std::filesystem;

class AppWholeFolder : public AppTest
{
   protected:
	AppWholeFolder()
	{
		save_map(flat(), path("flat.yaml"));
		save(observation_log(), path("walk.rawlog"));
	}

	Words words(const std::string& out, const Words& more = {}) const
	{
		Words all = {"-q", "-m", path("flat.yaml"), "-i", path("walk.rawlog"), "-o", path(out)};
		all.insert(all.end(), more.begin(), more.end());
		return all;
	}

	/// Contents of the files in a folder by their names.
	std::map<std::string, std::string> files_in(const std::string& folder) const
	{
		std::map<std::string, std::string> files;
		for (const auto& entry : fs::directory_iterator(path(folder)))
			files[entry.path().filename().string()] = read_file(entry.path());
		return files;
	}

	std::set<std::string> names_in(const std::string& folder) const
	{
		std::set<std::string> names;
		for (const auto& entry : fs::directory_iterator(path(folder))) names.insert(entry.path().filename().string());
		return names;
	}
};

TEST_F(AppWholeFolder, FoldersThatWereMadeForARunThatFailsAreRemoved)
{
	fs::create_directory(path("mine"));
	expect_refusal(
	    {"-m", path("no.yaml"), "-i", path("walk.rawlog"), "-o", path("mine/new/out")}, 2, {path("no.yaml")});
	EXPECT_TRUE(fs::exists(path("mine")));
	EXPECT_FALSE(fs::exists(path("mine/new")));
	expect_refusal({"-m", path("flat.yaml"), "-i", path("no.rawlog"), "-o", path("out/")}, 2, {"no.rawlog"});
	EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(AppWholeFolder, EveryOutputIsTriedBeforeAnyInputIsRead)
{
	const std::set<std::string> last = {"map.png", "scene.3Dscene", "report.html", "run.json", "summary.json"};
	for (const auto& name : last)
	{
		fs::create_directories(path("out/" + name));
		expect_refusal(
		    {"-m", path("no.yaml"), "-i", path("no.rawlog"), "-o", path("out")}, 3, {path("out/" + name) + ": "});
		fs::remove_all(path("out"));
	}
	for (const std::string option : {"--save-map", "--write-config", "--write-pf-ini"})
		expect_refusal(
		    {"-m", path("no.yaml"), "-i", path("no.rawlog"), "-o", path("out"), option, path("no/folder/file")}, 3,
		    {path("no/folder/file")});
	expect_refusal(
	    {"-m", path("no.yaml"), "-i", path("no.rawlog"), "-o", path("out"), "--index", path("no/folder/file")}, 3,
	    {path("no/folder/file") + ": cannot be written (No such file or directory)"});
	expect_refusal(
	    {"-m", path("no.yaml"), "-i", path("no.rawlog"), "--stream", "--index", path("no/folder/file")}, 3,
	    {path("no/folder/file")});
	write_file(path("atlas.yaml"), "maps: {a: {file: no.yaml}}");
	write_file(path("file"), "");
	for (const std::string folder : {"file", "file/folder"})
		expect_refusal(
		    {"-m", path("atlas.yaml"), "-i", path("no.rawlog"), "-o", path("out"), "--index", path(folder)}, 3,
		    {path(folder) + ": cannot be made"});
	expect_refusal(
	    {"-m", path("atlas.yaml"), "-i", path("no.rawlog"), "-o", path("out"), "--index", path("new/folder")}, 2,
	    {path("no.rawlog")});
	for (const char* name : {"out", "new"}) EXPECT_FALSE(fs::exists(path(name))) << name;
}

TEST_F(AppWholeFolder, FilesOfAnEarlierRunAreRemovedAndThoseOfOthersAreNot)
{
	fs::create_directory(path("out"));
	write_file(path("out/notes.txt"), "mine");
	write_file(path("out/fused.tum"), "mine: no run.json says otherwise");
	ASSERT_EQ(run(words("out")).status, 0);
	EXPECT_EQ(read_file(path("out/fused.tum")), "mine: no run.json says otherwise");

	ASSERT_EQ(run(words("out", {"--fuse"})).status, 0);
	EXPECT_TRUE(fs::exists(path("out/fused.csv")));
	ASSERT_EQ(run(words("out", {"--no-rawlog"})).status, 0);
	const std::set<std::string> expected = {"frames.csv",     "hypotheses.csv", "map.png",       "notes.txt",
	                                        "report.html",    "run.json",       "scene.3Dscene", "summary.json",
	                                        "trajectory.tum", "trajectory.txt"};
	EXPECT_EQ(names_in("out"), expected);
}

TEST_F(AppWholeFolder, ARecordThatWasTamperedWithRemovesNothingElse)
{
	ASSERT_EQ(run(words("out")).status, 0);
	write_file(path("out/notes.txt"), "mine");
	write_file(path("precious.txt"), "mine");
	for (const std::string record :
	     {R"({"files": ["notes.txt", "../precious.txt", "/etc/passwd", 7, ""]})", R"({"files": "notes.txt"})", "[1, 2",
	      "", "7"})
	{
		write_file(path("out/run.json"), record);
		ASSERT_EQ(run(words("out")).status, 0);
		EXPECT_TRUE(fs::exists(path("out/notes.txt"))) << record;
		EXPECT_TRUE(fs::exists(path("precious.txt"))) << record;
	}
}

TEST_F(AppWholeFolder, ARunThatCannotFinishLeavesAllOfTheEarlierResults)
{
	ASSERT_EQ(run(words("out")).status, 0);
	const auto before = files_in("out");
	for (const int size : {1, 4, 16})  // [KiB] that any file may have
	{
		const std::string command = "trap '' XFSZ; ulimit -f " + std::to_string(size) + "; exec " RAWLOG_LOCALIZE +
		                            " -q --frames 3: -m " + path("flat.yaml") + " -i " + path("walk.rawlog") + " -o " +
		                            path("out");
		EXPECT_EQ(run_program({"bash", "-c", command}).status, 3) << size;
		EXPECT_EQ(files_in("out"), before) << size;
	}
}

TEST_F(AppWholeFolder, AKilledRunLeavesWholeFilesOnlyAndTheNextRunTidiesUp)
{
	Objects log;
	for (int i = 0; i < 20; i++)
		for (const auto& object : observation_log()) log.push_back(object);
	save(log, path("walk.rawlog"));
	const auto start_time = std::chrono::steady_clock::now();
	ASSERT_EQ(run(words("whole")).status, 0);
	const auto duration = std::chrono::steady_clock::now() - start_time;
	const std::set<std::string> all = names_in("whole");
	int left = 0;
	const int points = fault_cases(8, 50);
	for (int point = 0; point < points; point++)
	{
		Process process = start(words("out"));
		std::this_thread::sleep_for(point * duration / points);
		process.send(SIGKILL);
		process.wait();
		if (!fs::exists(path("out"))) continue;
		const auto names = names_in("out");
		for (const auto& name : names) left += name.rfind(".tmp", 0) == 0;
		if (names.count("frames.csv") > 0)
		{
			EXPECT_EQ(CsvTable(path("out/frames.csv"), kFramesHeader).size(), log.size()) << point;
		}
		if (names.count("localized.rawlog") > 0)
		{
			EXPECT_EQ(load(path("out/localized.rawlog")).size(), 3 * log.size()) << point;
		}
		if (names.count("summary.json") == 0) continue;
		for (const auto& name : all) EXPECT_EQ(names.count(name), 1U) << name << " at " << point;
	}
	EXPECT_GT(left, 0);  // else no run was killed within its work
	ASSERT_EQ(run(words("out")).status, 0);
	EXPECT_EQ(names_in("out"), all);
}

TEST_F(AppWholeFolder, WhatAnotherProcessIsWritingIsLeftAlone)
{
	fs::create_directory(path("out"));
	const std::string busy = path("out/.tmp4194305-frames.csv"), abandoned = path("out/.tmp4194306-fused.csv");
	write_file(busy, "half");
	write_file(abandoned, "half");
	write_file(path("out/.tmp-frames.csv"), "another program's");
	const int lock = open(busy.c_str(), O_RDWR | O_CLOEXEC);
	ASSERT_EQ(flock(lock, LOCK_EX), 0);
	EXPECT_EQ(run(words("out")).status, 0);
	EXPECT_TRUE(fs::exists(busy));
	EXPECT_FALSE(fs::exists(abandoned));
	EXPECT_TRUE(fs::exists(path("out/.tmp-frames.csv")));
	close(lock);
	EXPECT_EQ(run(words("out")).status, 0);
	EXPECT_FALSE(fs::exists(busy));
}
