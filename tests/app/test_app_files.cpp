// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// No file is written over one that is read, or over another that is written.
#include <sys/stat.h>

#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;
namespace fs = std::filesystem;

class AppFiles : public AppTest
{
   protected:
	AppFiles()
	{
		save_gridmap(flat(), path("a.gridmap.gz"));
		save(observation_log(), path("a.rawlog"));
	}

	/// A command line without its folder for results.
	Words words(const Words& more) const
	{
		Words all = {"-m", path("a.gridmap.gz"), "-i", path("a.rawlog")};
		all.insert(all.end(), more.begin(), more.end());
		return all;
	}

	/// Expects that the command line is refused for `file`, which keeps what is in it, before anything is written.
	void expect_kept(const std::string& file, const std::string& why, const Words& command_line) const
	{
		const std::string before = read_file(file);
		expect_refusal(command_line, 3, {file + ": is " + why, "name another file"});
		EXPECT_EQ(read_file(file), before);
		EXPECT_FALSE(fs::exists(path("out")));
	}
};

TEST_F(AppFiles, InputRawlogIsNotWrittenOver)
{
	const std::string why = "the input of --input";
	expect_kept(path("a.rawlog"), why, words({"-o", path("out"), "--write-pf-ini", path("a.ini")}));
	expect_kept(path("a.rawlog"), why, words({"-o", path("out"), "--write-pf-ini", path("a.rawlog")}));
	expect_kept(path("a.rawlog"), why, words({"-o", path("out"), "--write-config", path("a.rawlog")}));
	expect_kept(path("a.rawlog"), why, words({"-o", path("out"), "--save-map", path("a.rawlog")}));

	fs::create_directory(path("earlier"));
	const std::string localized = path("earlier/localized.rawlog");
	save(observation_log(), localized);
	expect_kept(localized, why, {"-m", path("a.gridmap.gz"), "-i", localized, "-o", path("earlier")});
	fs::create_symlink(localized, path("link.rawlog"));
	expect_kept(
	    path("earlier/./localized.rawlog"), why,
	    {"-m", path("a.gridmap.gz"), "-i", path("link.rawlog"), "-o", path("earlier/.")});
}

TEST_F(AppFiles, MapIsNotWrittenOver)
{
	const std::string why = "the input of --map";
	expect_kept(path("a.gridmap.gz"), why, words({"-o", path("out"), "--save-map", path("a.gridmap.gz")}));
	save(observation_log(), path("b.rawlog"));
	expect_kept(
	    path("a.gridmap.gz"), why,
	    {"-m", path("a.gridmap.gz"), "-i", path("b.rawlog"), "-o", path("out"), "--write-pf-ini", path("a.ini")});
}

TEST_F(AppFiles, ImageOfAYamlMapIsNotWrittenOver)
{
	write_file(path("map.png"), "an image");
	write_file(
	    path("map.yaml"),
	    "image: map.png\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n");
	expect_kept(
	    path("map.png"), "the input of --map", {"-m", path("map.yaml"), "-i", path("a.rawlog"), "-o", folder()});
}

TEST_F(AppFiles, OtherInputsAreNotWrittenOver)
{
	write_file(path("c.ini"), "");
	save_truth(path("trajectory.txt"), false);
	expect_kept(
	    path("c.ini"), "the input of --config",
	    words({"-o", path("out"), "-c", path("c.ini"), "--write-pf-ini", path("c.ini")}));
	expect_kept(path("c.ini"), "the input of --config", {"-c", path("c.ini"), "--write-config", path("c.ini")});
	expect_kept(
	    path("trajectory.txt"), "the input of --ground-truth",
	    words({"-o", folder(), "--ground-truth", path("trajectory.txt")}));
	write_file(path("module.so"), "");
	expect_kept(
	    path("module.so"), "the input of --plugins",
	    words({"-o", path("out"), "--plugins", "other.so," + path("module.so"), "--save-map", path("module.so")}));
}

TEST_F(AppFiles, NoFileIsWrittenTwice)
{
	const auto refuse = [&](const std::string& file, const std::string& option, const Words& more)
	{
		Words all = words({"-o", path("out")});
		all.insert(all.end(), more.begin(), more.end());
		expect_refusal(all, 3, {file + ": is written by " + option + ", too", "name another file"});
		EXPECT_FALSE(fs::exists(path("out")));
	};
	refuse(path("out/frames.csv"), "--output", {"--save-map", path("out/frames.csv")});
	refuse(path("out/localized.rawlog"), "--output", {"--write-pf-ini", path("out/localized.ini")});
	refuse(path("x.ini"), "--write-config", {"--write-config", path("out/../x.ini"), "--write-pf-ini", path("x.ini")});
	refuse(path("x.rawlog"), "--write-pf-ini", {"--write-pf-ini", path("x.rawlog")});
}

TEST_F(AppFiles, TheTableListsAllThatIsWritten)
{
	const auto result = run(words(
	    {"-o", path("out"), "--save-map", path("saved.map"), "--write-config", path("all.ini"), "--write-pf-ini",
	     path("pf.ini")}));
	EXPECT_EQ(result.status, 0) << result.err;
	EXPECT_NE(result.out.find(" map.png "), std::string::npos) << result.out;
	for (const char* name : {"saved.map", "all.ini", "pf.ini", "pf.rawlog", "pf.gridmap.gz"})
		EXPECT_NE(result.out.find(" " + path(name)), std::string::npos) << name << result.out;
}

TEST_F(AppFiles, TheIndexIsKeptInItsFile)
{
	const std::string index = path("a.index");
	const auto localize = [&](const Words& more, const std::string& came)
	{
		Words all = words({"-o", path("out"), "--index", index});
		all.insert(all.end(), more.begin(), more.end());
		const auto result = run(all);
		EXPECT_EQ(result.status, 0) << result.err;
		EXPECT_NE(result.out.find(came), std::string::npos) << result.out;
		return read_file(path("out/trajectory.tum"));
	};
	const std::string poses = localize({}, "the index was built: the file did not exist\n");
	EXPECT_NE(read_file(path("out/summary.json")).find("\"loaded\": false"), std::string::npos);
	EXPECT_EQ(localize({}, ", loaded from " + index + "\n"), poses);
	EXPECT_NE(read_file(path("out/summary.json")).find("\"loaded\": true"), std::string::npos);
	EXPECT_NE(read_file(path("out/run.json")).find("\"fingerprint\""), std::string::npos);

	write_file(path("other.ini"), "[coarse_search]\nspacing = 0.3\n");
	localize({"-c", path("other.ini")}, "the index was built: the file is the index of other parameters");
	EXPECT_EQ(localize({}, ", saved in " + index + "\n"), poses);
	std::string damaged = read_file(index);
	damaged[damaged.size() / 2] ^= 1;
	write_file(index, damaged);
	EXPECT_EQ(localize({}, "the index was built: the file is damaged\n"), poses);
	save_gridmap(
	    make_picture_grid(enlarge({"########", "#......#", "#..##..#", "#......#", "########"}, 20), 0.05),
	    path("a.gridmap.gz"));
	localize({}, "the index was built: the file is the index of another map\n");

	const std::string map = read_file(path("a.gridmap.gz"));
	expect_refusal(
	    words({"-o", path("new"), "--index", path("a.gridmap.gz")}), 3,
	    {path("a.gridmap.gz") + ": is the input of --map", "name another file"});
	EXPECT_EQ(read_file(path("a.gridmap.gz")), map);
	write_file(path("notes.txt"), "not an index");
	save_gridmap(make_picture_grid({"####", "####"}, 0.05), path("a.gridmap.gz"));  // refused later
	expect_refusal(
	    words({"-o", path("new"), "--index", path("notes.txt")}), 3, {path("notes.txt"), "exists and is not"});
	EXPECT_EQ(read_file(path("notes.txt")), "not an index");
	ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
	for (const auto& name : {path("pipe"), path("out")})
		expect_refusal(
		    words({"-o", path("new"), "--index", name}), 3, {name + ": is a folder, a device or a pipe", "--index"});
	EXPECT_TRUE(std::filesystem::is_fifo(path("pipe")));
}
