// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Inputs that cannot be used: one line each, and the right exit status.
#include <mrpt/obs/CObservationOdometry.h>
#include <sys/stat.h>

#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;
namespace fs = std::filesystem;

class AppBadInput : public AppTest
{
   protected:
	AppBadInput()
	{
		save_map(flat(), path("flat.yaml"));
		save(observation_log(), path("walk.rawlog"));
	}

	/// Nothing is left behind under a final or a temporary name.
	void expect_nothing_written() const { EXPECT_FALSE(fs::exists(path("out"))); }

	void expect_bad_rawlog(const std::string& rawlog, const Words& parts) const
	{
		expect_refusal({"-m", path("flat.yaml"), "-i", rawlog, "-o", path("out")}, 2, parts);
		expect_nothing_written();
	}

	void expect_bad_map(const Words& map, const Words& parts) const
	{
		Words words = {"-i", path("walk.rawlog"), "-o", path("out"), "-m"};
		words.insert(words.end(), map.begin(), map.end());
		expect_refusal(words, 2, parts);
		expect_nothing_written();
	}

	void expect_bad_config(const std::string& ini, const Words& parts) const
	{
		write_file(path("bad.ini"), ini);
		expect_refusal(
		    {"-m", path("flat.yaml"), "-i", path("walk.rawlog"), "-o", path("out"), "-c", path("bad.ini")}, 1, parts);
	}
};

TEST_F(AppBadInput, MissingRawlog)
{
	expect_bad_rawlog(path("no.rawlog"), {path("no.rawlog") + ": no such"});
}

TEST_F(AppBadInput, InputsThatMayNotBeRead)
{
	const std::string map = path("flat.yaml"), rawlog = path("walk.rawlog"), locked = path("locked");
	fs::create_directory(locked);
	fs::permissions(locked, fs::perms::none);
	const auto refuse = [&](const std::string& map_file, const std::string& rawlog_file, const std::string& part) {
		expect_refused(run_as_ordinary_user({"-m", map_file, "-i", rawlog_file, "-o", path("out")}), 2, {part});
	};
	fs::create_directory(path("out"));
	fs::permissions(path("out"), fs::perms::all);
	refuse(locked + "/map.yaml", rawlog, locked + "/map.yaml: cannot be read");
	refuse(map, locked + "/in.rawlog", locked + "/in.rawlog: cannot be reached (Permission denied)");
	fs::permissions(map, fs::perms::none);
	refuse(map, rawlog, map + ": cannot be read");
	EXPECT_TRUE(fs::is_empty(path("out")));
}

TEST_F(AppBadInput, FewFileDescriptorsAreNotBlamedOnTheFiles)
{
	int refused = 0;
	for (int descriptors = 4; descriptors < 24; descriptors++)
	{
		const auto result = run_program(
		    {"prlimit", "--nofile=" + std::to_string(descriptors), RAWLOG_LOCALIZE, "-m", path("flat.yaml"), "-i",
		     path("walk.rawlog"), "-o", path("out"), "-q"});
		constexpr int kNotLoaded = 127;  // the libraries of the program could not be opened
		if (result.status == 0 || result.status == kNotLoaded) continue;
		refused++;
		EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
		EXPECT_NE(result.err.find("allow the program more open files"), std::string::npos)
		    << descriptors << ": " << result.err;
	}
	EXPECT_GT(refused, 3);
}

TEST_F(AppBadInput, FolderAsRawlog)
{
	expect_bad_rawlog(folder().string(), {"folder"});
}

TEST_F(AppBadInput, EmptyRawlog)
{
	write_file(path("empty.rawlog"), "");
	expect_bad_rawlog(path("empty.rawlog"), {path("empty.rawlog") + ": is empty"});
}

TEST_F(AppBadInput, NotARawlog)
{
	write_file(path("text.rawlog"), "This is a text, not a rawlog.\n");
	expect_bad_rawlog(path("text.rawlog"), {"not a log that I know (MRPT rawlogs, "});
	write_file(path("noise.rawlog"), std::string(5000, '\xa5'));
	expect_bad_rawlog(path("noise.rawlog"), {"not a log that I know (MRPT rawlogs, "});
}

TEST_F(AppBadInput, RawlogCutWithinItsFirstObject)
{
	for (const std::size_t size : {20U, 100U, 300U})
	{
		write_file(path("cut.rawlog"), read_file(path("walk.rawlog")).substr(0, size));
		expect_bad_rawlog(path("cut.rawlog"), {path("cut.rawlog") + ": is cut short within its first object"});
	}
}

TEST_F(AppBadInput, RawlogThatIsNoRegularFile)
{
	ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
	for (const std::string& file : {path("pipe"), std::string("/dev/null")})
		expect_bad_rawlog(file, {file + ": is a device or a pipe", "regular file"});
}

TEST_F(AppBadInput, RawlogWithout2DScans)
{
	save({std::make_shared<mrpt::obs::CObservationOdometry>()}, path("odometry.rawlog"));
	expect_bad_rawlog(path("odometry.rawlog"), {"no 2D laser scan"});
}

TEST_F(AppBadInput, MissingMap)
{
	expect_bad_map({path("no.yaml")}, {path("no.yaml")});
}

TEST_F(AppBadInput, EmptyMap)
{
	write_file(path("empty.gridmap.gz"), "");
	expect_bad_map({path("empty.gridmap.gz")}, {"is empty; copy or save it again"});
}

TEST_F(AppBadInput, NotAMap)
{
	write_file(path("text.gridmap.gz"), "This is a text, not a map.\n");
	expect_bad_map({path("text.gridmap.gz")}, {path("text.gridmap.gz")});
}

TEST_F(AppBadInput, MapWithoutAFreeCell)
{
	save_gridmap(make_picture_grid({"###", "#?#", "###"}, 0.5), path("solid.gridmap.gz"));
	expect_bad_map({path("solid.gridmap.gz")}, {path("solid.gridmap.gz"), "free cell"});
}

TEST_F(AppBadInput, YamlThatNamesAMissingImage)
{
	write_file(
	    path("map.yaml"),
	    "image: gone.png\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n");
	expect_bad_map({path("map.yaml")}, {"gone.png"});
}

TEST_F(AppBadInput, ImageWithoutResolution)
{
	write_file(path("map.pgm"), "P5 2 2 255\n" + std::string(4, '\xff'));
	expect_bad_map({path("map.pgm")}, {path("map.pgm"), "--resolution"});
}

TEST_F(AppBadInput, DamagedImageDoesNotLetTheImageLibraryTalk)
{
	write_file(
	    path("map.png"), std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x10\0\0\0\x10\x08\0\0\0\0junkIEND", 37));
	expect_bad_map({path("map.png"), "--resolution", "0.05"}, {path("map.png")});
}

TEST_F(AppBadInput, GridTooLargeForMemory)
{
	write_file(path("huge.pgm"), "P5 2000000 2000000 255\n");
	expect_bad_map({path("huge.pgm"), "--resolution", "0.05"}, {path("huge.pgm"), "memory"});
}

TEST_F(AppBadInput, MapWhoseIndexDoesNotFitIntoMemory)
{
	constexpr unsigned kSide = 9000;
	write_file(path("white.pgm"), "P5\n9000 9000\n255\n" + std::string(kSide * kSide, '\xFE'));
	const std::string limited = "ulimit -v 1200000; exec " RAWLOG_LOCALIZE " \"$@\"";
	expect_refused(
	    run_program(
	        {"sh", "-c", limited, "sh", "-m", path("white.pgm"), "--resolution", "0.05", "-i", path("walk.rawlog"),
	         "-o", path("out"), "-q"}),
	    2, {path("white.pgm") + ": the index of 9000 x 9000 cells takes about ", "use a coarser or smaller map"});
	expect_nothing_written();
}

TEST_F(AppBadInput, MissingConfig)
{
	expect_refusal(
	    {"-m", path("flat.yaml"), "-i", path("walk.rawlog"), "-o", path("out"), "-c", path("no.ini")}, 1,
	    {path("no.ini")});
}

TEST_F(AppBadInput, ConfigWithAnUnknownKey)
{
	expect_bad_config("[paper]\nbeens = 60\n", {path("bad.ini"), "beens"});
	expect_bad_config("[papers]\nbins = 60\n", {path("bad.ini"), "papers"});
}

TEST_F(AppBadInput, ConfigWithAValueOutOfRange)
{
	expect_bad_config("[paper]\nbins = 1\n", {path("bad.ini"), "bins"});
	expect_bad_config("[grid]\nfree_threshold = lots\n", {path("bad.ini"), "free_threshold"});
}

TEST_F(AppBadInput, ConfigThatIsNoConfig)
{
	expect_bad_config("[paper]\nbins\n", {"rawlog-localize: " + path("bad.ini") + ":2: 'bins' is neither", "correct"});
	const std::string bytes(
	    "\x7F"
	    "ELF\x02\x01\0\0",
	    8);
	expect_bad_config(bytes + std::string(500, '\xE4'), {path("bad.ini") + ":1: '?ELF????", "...'"});
}

TEST_F(AppBadInput, LabelThatIsNotInTheRawlog)
{
	expect_refusal(
	    {"-m", path("flat.yaml"), "-i", path("walk.rawlog"), "-o", path("out"), "--sensor-label", "REAR"}, 1,
	    {path("walk.rawlog"), "'REAR'", "'LASER'"});
}

TEST_F(AppBadInput, FramesBeyondTheLast)
{
	expect_refusal(
	    {"-m", path("flat.yaml"), "-i", path("walk.rawlog"), "-o", path("out"), "--frames", "100:"}, 1,
	    {"--frames", "100", "11"});
}

TEST_F(AppBadInput, NamesThatHoldAnything)
{
	const Words map_and_log = {"-i", path("walk.rawlog"), "-o", path("out"), "-m"};
	for (const auto& [name, shown] : {std::pair("=none.gridmap", "=none.gridmap: "), {"no\nmap", "no?map: cannot be"}})
	{
		Words words = map_and_log;
		words.push_back(name);
		expect_refusal(words, 2, {shown});
	}
}

TEST_F(AppBadInput, GroundTruthOfOtherTimesIsReportedAfterTheResults)
{
	write_file(path("other.txt"), "5 1 2 3\n");
	const auto result = run(
	    {"-q", "-m", path("flat.yaml"), "-i", path("walk.rawlog"), "-o", path("out"), "--ground-truth",
	     path("other.txt")});
	expect_refused(result, 2, {path("other.txt") + ": no line has the time of a scan"});
	EXPECT_EQ(lines_of(read_file(path("out/frames.csv"))).size(), walk().size() + 1);
}

TEST_F(AppBadInput, GroundTruthThatCannotBeUsed)
{
	const auto refuse = [&](const std::string& file, const Words& parts)
	{
		expect_refusal(
		    {"-m", path("flat.yaml"), "-i", path("walk.rawlog"), "-o", path("out"), "--ground-truth", file}, 2, parts);
	};
	refuse(path("no.txt"), {path("no.txt")});
	write_file(path("empty.txt"), "% nothing\n");
	refuse(path("empty.txt"), {path("empty.txt"), "no pose"});
	write_file(path("three.txt"), "1 2 3\n");
	refuse(path("three.txt"), {path("three.txt"), "line 1"});
	write_file(path("words.txt"), "1 2 3 4\n1 2 three 4\n");
	refuse(path("words.txt"), {path("words.txt"), "line 2"});
}
