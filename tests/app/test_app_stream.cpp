// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Logs that are read while they are written, and lines that are printed while frames become known.
#include <fcntl.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/obs/CObservationComment.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <thread>

#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;
namespace fs = std::filesystem;
using nlohmann::json;

class AppStream : public AppTest
{
   protected:
	AppStream()
	{
		save_map(flat(), path("flat.yaml"));
		save(observation_log(), path("walk.rawlog"));
		for (const auto& object : observation_log()) objects_.push_back(text_of(*object));
	}

	/// An object as it stands in a rawlog that is not packed.
	static std::string text_of(const mrpt::serialization::CSerializable& object)
	{
		const auto bytes = bytes_of(object);
		return {bytes.begin(), bytes.end()};
	}

	/// The objects from `begin` up to `end` of an unpacked rawlog.
	std::string part(std::size_t begin, std::size_t end) const
	{
		std::string bytes;
		for (std::size_t i = begin; i < end; i++) bytes += objects_[i];
		return bytes;
	}
	std::string part(std::size_t begin) const { return part(begin, objects_.size()); }

	Words words(const std::string& log, const Words& more = {}) const
	{
		Words all = {"-m", path("flat.yaml"), "-i", log, "--stream"};
		all.insert(all.end(), more.begin(), more.end());
		return all;
	}

	/// Runs the program with a file on its standard input.
	ProcessResult run_with_input(const std::string& file, const Words& arguments) const
	{
		return run_program({"bash", "-c", command(arguments) + " < " + file});
	}

	static std::string command(const Words& arguments)
	{
		std::string text = "exec " RAWLOG_LOCALIZE;
		for (const auto& word : arguments) text += " " + word;
		return text;
	}

	/// Starts the program with a pipe as its standard input, whose other end is `descriptor`.
	Process start_with_pipe(const Words& arguments, int& descriptor) const
	{
		fs::remove(path("pipe"));
		fs::remove(path("stdout"));
		mkfifo(path("pipe").c_str(), 0600);
		Process process({"bash", "-c", command(arguments) + " < " + path("pipe")}, folder());
		descriptor = open(path("pipe").c_str(), O_WRONLY | O_CLOEXEC);
		return process;
	}

	static void send(int descriptor, const std::string& bytes)
	{
		for (std::size_t done = 0; done < bytes.size();)
		{
			const ssize_t written = write(descriptor, bytes.data() + done, bytes.size() - done);
			ASSERT_GT(written, 0);
			done += static_cast<std::size_t>(written);
		}
	}

	/// Waits until so many lines have been printed. A reader of a file may see the start of what is being written.
	std::vector<json> wait_for_lines(Process& process, std::size_t count) const
	{
		const auto whole_lines = [&]
		{
			const std::string text = fs::exists(path("stdout")) ? read_file(path("stdout")) : "";
			return text.substr(0, text.find_last_of('\n') + 1);
		};
		while (process.running() && lines_of(whole_lines()).size() < count)
			std::this_thread::sleep_for(std::chrono::milliseconds(2));
		return parse(whole_lines());
	}

	/// Parses the lines, each of which has to be whole.
	static std::vector<json> parse(const std::string& text)
	{
		EXPECT_TRUE(text.empty() || text.back() == '\n') << text;
		std::vector<json> lines;
		for (const auto& line : lines_of(text)) lines.push_back(json::parse(line));
		return lines;
	}

	/// Prints how long frames waited for a thread and for being printed, beyond the time that localizing them took.
	/// Most of them are printed within 5 ms, also on a machine that does other things.
	static void check_waits(const std::string& how, const std::vector<json>& lines)
	{
		std::vector<double> waits;  // [ms]
		for (const auto& line : lines)
		{
			waits.push_back(line["latency_ms"].get<double>() - line["total_ms"].get<double>());
			EXPECT_GE(waits.back(), 0);
		}
		std::sort(waits.begin(), waits.end());
		EXPECT_LT(waits[waits.size() / 2], 5);
		std::printf(
		    "[ waits    ] %s: median %.3f ms, p90 %.3f ms, greatest %.3f ms\n", how.c_str(), waits[waits.size() / 2],
		    waits[waits.size() * 9 / 10], waits.back());
	}

	/// Without the times, which differ from run to run.
	static std::vector<json> without_times(std::vector<json> lines)
	{
		for (auto& line : lines)
			for (const char* name : {"total_ms", "latency_ms"}) EXPECT_EQ(line.erase(name), 1U) << line;
		return lines;
	}

	std::vector<std::string> objects_;  //!< of the log, as they stand in it
};

TEST_F(AppStream, WhatComesBeforeTheFirstScanDoesNotFillTheMemory)
{
	mrpt::obs::CObservationComment comment;
	comment.text = std::string(10'000'000, 'c');
	write_file(path("comment"), text_of(comment));
	const std::string feed = "for i in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15; do cat " + path("comment") +
	                         "; done; cat " + path("walk.rawlog") + " | gunzip";
	const auto result = run_program({"bash", "-c", "(" + feed + ") | (" + command(words("-", {"-q"})) + ")"});
	expect_refused(
	    result, 2, {"standard input: shows no 2D laser scan in its first 10 objects", "name the label of a laser"});
	EXPECT_LT(result.memory, 600'000);
	const auto named = run_program(
	    {"bash", "-c", "(" + feed + ") | (" + command(words("-", {"-q", "--sensor-label", "LASER"})) + ")"});
	EXPECT_EQ(named.status, 0) << named.err;
	EXPECT_EQ(lines_of(named.out).size(), walk().size());
}

TEST_F(AppStream, LinesSayWhatTheFilesSay)
{
	const auto result = run(words(path("walk.rawlog"), {"-o", path("out")}));
	ASSERT_EQ(result.status, 0) << result.err;
	const auto lines = parse(result.out);
	const CsvTable frames(path("out/frames.csv"), kFramesHeader), all(path("out/hypotheses.csv"), kHypothesesHeader);
	ASSERT_EQ(lines.size(), frames.size());
	std::size_t row = 0;
	for (std::size_t i = 0; i < lines.size(); i++)
	{
		EXPECT_EQ(lines[i]["frame"], i);
		EXPECT_EQ(lines[i]["status"], frames.text(i, "status"));
		for (const char* name : {"timestamp", "x", "y", "phi", "confidence"})
			EXPECT_NEAR(lines[i][name].get<double>(), frames.number(i, name), 1e-6) << name << " of " << i;
		EXPECT_NEAR(lines[i]["covariance"][4].get<double>(), frames.number(i, "cov_yphi"), 1e-6);
		for (const auto& hypothesis : lines[i]["hypotheses"])
			EXPECT_NEAR(hypothesis["probability"].get<double>(), all.number(row++, "probability"), 1e-5);
	}
	EXPECT_EQ(row, all.size());
}

TEST_F(AppStream, APipedLogGivesTheSameLinesPackedOrNotOnAnyNumberOfThreads)
{
	const auto expected = run(words(path("walk.rawlog")));
	ASSERT_EQ(expected.status, 0) << expected.err;
	EXPECT_EQ(expected.err, "");
	write_file(path("plain.rawlog"), part(0));
	write_file(path("twice.rawlog"), read_file(path("walk.rawlog")) + read_file(path("walk.rawlog")));
	for (const std::string threads : {"1", "3"})
	{
		for (const char* name : {"walk.rawlog", "plain.rawlog"})
		{
			const auto result = run_with_input(path(name), words("-", {"--threads", threads, "-o", path("out")}));
			EXPECT_EQ(result.status, 0) << result.err;
			EXPECT_EQ(without_times(parse(result.out)), without_times(parse(expected.out))) << name << threads;
			EXPECT_EQ(load(path("out/localized.rawlog")).size(), 3 * walk().size());
			EXPECT_EQ(json::parse(read_file(path("out/run.json")))["log"]["sensor_scans"], walk().size());
		}
		const auto twice = run_with_input(path("twice.rawlog"), words("-", {"--threads", threads}));
		EXPECT_EQ(parse(twice.out).size(), 2 * walk().size()) << twice.err;
	}
}

TEST_F(AppStream, LinesAreThereBeforeMoreIsSent)
{
	for (const std::string threads : {"1", "2"})
	{
		int input = -1;
		Process process = start_with_pipe(words("-", {"--threads", threads}), input);
		for (std::size_t i = 0; i < objects_.size(); i++)
		{
			send(input, objects_[i]);
			EXPECT_EQ(wait_for_lines(process, i + 1).size(), i + 1);
		}
		close(input);
		const auto result = process.wait();
		EXPECT_EQ(result.status, 0) << result.err;
		check_waits("a scan at a time, " + threads + " threads", parse(result.out));
	}
}

/// The index is saved when it has been built, and no scan has been sent by then.
TEST_F(AppStream, TheMapIsReadyBeforeTheFirstScanComes)
{
	constexpr int kLongest = 60'000;  // [ms]
	int input = -1;
	Process process = start_with_pipe(words("-", {"--index", path("index")}), input);
	for (int i = 0; i < kLongest && process.running() && !fs::exists(path("index")); i++)
		std::this_thread::sleep_for(std::chrono::milliseconds(1));
	EXPECT_TRUE(fs::exists(path("index")));
	send(input, part(0));
	close(input);
	const auto result = process.wait();
	EXPECT_EQ(result.status, 0) << result.err;
	EXPECT_EQ(parse(result.out).size(), walk().size());
}

TEST_F(AppStream, AScanEvery25MillisecondsIsFollowed)
{
	constexpr std::size_t kScans = 80;
	constexpr std::chrono::milliseconds kPeriod(25);
	int input = -1;
	Process process = start_with_pipe(words("-", {"--threads", "2"}), input);
	send(input, objects_[0]);
	wait_for_lines(process, 1);
	auto next = std::chrono::steady_clock::now();
	for (std::size_t i = 1; i < kScans; i++)
	{
		std::this_thread::sleep_until(next += kPeriod);
		send(input, objects_[i % objects_.size()]);
	}
	close(input);
	const auto result = process.wait();
	EXPECT_EQ(result.status, 0) << result.err;
	const auto lines = parse(result.out);
	ASSERT_EQ(lines.size(), kScans);
	check_waits("a scan every 25 ms", lines);
}

TEST_F(AppStream, AnInputThatEndsWithinAnObjectLeavesWholeLines)
{
	for (const std::size_t whole : {std::size_t(1), std::size_t(5)})
		for (const std::size_t missing : {std::size_t(1), objects_[whole].size() / 2})
		{
			const std::string bytes = part(0, whole + 1);
			write_file(path("cut.rawlog"), bytes.substr(0, bytes.size() - missing));
			const auto result = run_with_input(path("cut.rawlog"), words("-"));
			EXPECT_EQ(result.status, 2);
			EXPECT_EQ(parse(result.out).size(), whole);
			EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
			EXPECT_NE(result.err.find("standard input: is cut short or damaged after object"), std::string::npos)
			    << result.err;
		}
}

TEST_F(AppStream, ASenderThatIsKilledLeavesWholeLines)
{
	const std::string bytes = part(0, 6);
	write_file(path("cut.rawlog"), bytes.substr(0, bytes.size() - objects_[5].size() / 2));
	mkfifo(path("pipe").c_str(), 0600);
	fs::create_directory(path("sender"));
	Process sender(
	    {"bash", "-c", "exec > " + path("pipe") + "; cat " + path("cut.rawlog") + "; exec sleep 1000"}, path("sender"));
	Process process({"bash", "-c", command(words("-")) + " < " + path("pipe")}, folder());
	EXPECT_EQ(wait_for_lines(process, 5).size(), 5U);
	EXPECT_TRUE(process.running());
	sender.send(SIGKILL);
	EXPECT_EQ(sender.wait().status, 128 + SIGKILL);
	const auto result = process.wait();
	EXPECT_EQ(result.status, 2);
	EXPECT_EQ(parse(result.out).size(), 5U);
	EXPECT_NE(result.err.find("is cut short or damaged after object"), std::string::npos) << result.err;
}

TEST_F(AppStream, InputsThatAreNoRawlogs)
{
	write_file(path("empty"), "");
	write_file(path("text"), "This is a text, not a rawlog.\n");
	write_file(path("bag"), "#ROSBAG V2.0\n");
	for (const char* name : {"empty", "text", "bag"})
		expect_refused(
		    run_with_input(path(name), words("-")), 2,
		    {"standard input: is ", "not an MRPT rawlog", "read a bag or a CARMEN log from its file"});
	write_file(path("grown.bag"), "#ROSBAG V2.0\n" + std::string(100, 'x'));
	expect_refusal(words(path("grown.bag"), {"--follow"}), 2, {"not an MRPT rawlog", "once it is complete"});
	expect_refusal(words(path("none.rawlog"), {"--follow"}), 2, {"none.rawlog: cannot be opened (No such file"});
	expect_refusal(
	    words(folder().string(), {"--follow"}), 2, {"is a folder, as a ROS 2 bag is", "once it is complete"});
}

TEST_F(AppStream, AFileIsFollowedWhileItGrowsUntilItIsRemoved)
{
	for (const Words& more : {Words{}, Words{"-o", path("out")}})
	{
		write_file(path("grows.rawlog"), part(0, 2) + objects_[2].substr(0, 40));
		fs::remove(path("stdout"));  // of the process before
		Words arguments = words(path("grows.rawlog"), {"--follow"});
		arguments.insert(arguments.end(), more.begin(), more.end());
		Process process = start(arguments);
		EXPECT_EQ(wait_for_lines(process, 2).size(), 2U);
		std::ofstream grows(path("grows.rawlog"), std::ios::app | std::ios::binary);
		grows << objects_[2].substr(40) << std::flush;
		EXPECT_EQ(wait_for_lines(process, 3).size(), 3U);
		grows << part(3) << std::flush;
		EXPECT_EQ(wait_for_lines(process, walk().size()).size(), walk().size());
		EXPECT_TRUE(process.running());
		fs::remove(path("grows.rawlog"));
		const auto result = process.wait();
		EXPECT_EQ(result.status, 0) << result.err;
		EXPECT_EQ(fs::exists(path("out/frames.csv")), !more.empty());
	}
}

TEST_F(AppStream, AFollowedFileThatIsCutShortEndsTheRunWithALine)
{
	for (const bool is_packed : {false, true})
		for (const std::size_t left : {std::size_t(0), std::size_t(1000)})
		{
			const std::string log = path("grows.rawlog");
			write_file(log, is_packed ? read_file(path("walk.rawlog")) : part(0));
			fs::remove(path("stdout"));
			fs::remove_all(path("out"));
			Process process = start(words(log, {"--follow", "-q", "-o", path("out")}));
			EXPECT_EQ(wait_for_lines(process, walk().size()).size(), walk().size());
			fs::resize_file(log, left);
			const auto result = process.wait();
			EXPECT_EQ(result.status, 2);
			EXPECT_EQ(
			    result.err, "rawlog-localize: " + log +
			                    ": has become shorter while it was followed, after object 12; run again, and let "
			                    "nothing cut it meanwhile; the 12 frames before that are in " +
			                    path("out") + "\n");
			EXPECT_EQ(CsvTable(path("out/frames.csv"), kFramesHeader).size(), walk().size());
			EXPECT_TRUE(fs::exists(path("out/summary.json")));
		}
}

TEST_F(AppStream, ALiveLogWithoutTheFramesThatWereAskedForIsRefusedLikeAFile)
{
	mrpt::obs::CObservationComment comment;
	write_file(path("none.rawlog"), text_of(comment));
	struct Case
	{
		const char* log;
		Words options;
		int status;
	};
	for (const auto& [log, options, status] :
	     {Case{"walk.rawlog", {"--sensor-label", "nosuch"}, 1}, Case{"walk.rawlog", {"--frames", "100:"}, 1},
	      Case{"walk.rawlog", {"--frames", "12:", "--sensor-label", "LASER"}, 1},
	      Case{"none.rawlog", {"--sensor-label", "nosuch"}, 2}})
	{
		Words arguments = {"-o", path("out"), "-q"};
		arguments.insert(arguments.end(), options.begin(), options.end());
		const auto of_file = run(words(path(log), arguments));
		ASSERT_EQ(of_file.status, status) << of_file.err;
		for (const std::string threads : {"1", "3"})
		{
			fs::remove_all(path("out"));
			Words live = arguments;
			live.insert(live.end(), {"--threads", threads});
			const auto result = run_with_input(path(log), words("-", live));
			EXPECT_EQ(result.status, status) << result.err;
			std::string expected = of_file.err;
			if (const auto name = expected.find(path(log)); name != std::string::npos)
				expected.replace(name, path(log).size(), "standard input");
			EXPECT_EQ(result.err, expected);
			EXPECT_EQ(CsvTable(path("out/frames.csv"), kFramesHeader).size(), 0U);
			EXPECT_TRUE(fs::exists(path("out/summary.json")));
		}
	}
	save(
	    {walk_scan(0, "front"), walk_scan(1, "rear"), walk_scan(2, "front"), walk_scan(3, "rear")}, path("two.rawlog"));
	EXPECT_NE(
	    run_with_input(path("two.rawlog"), words("-", {"--sensor-label", "top"})).err.find("can be 'front', 'rear'"),
	    std::string::npos);
	EXPECT_EQ(run_with_input(path("walk.rawlog"), words("-", {"--frames", "11:"})).status, 0);
}

/// As rawlog-grabber writes it: a packer hands the bytes on late, in pieces that end anywhere.
TEST_F(AppStream, APackedFileIsFollowedWhileItIsWritten)
{
	constexpr int kRepeats = 20;
	mrpt::io::CFileGZOutputStream grows(path("grows.rawlog"));
	Process process = start(words(path("grows.rawlog"), {"--follow"}));
	for (int i = 0; i < kRepeats; i++)
	{
		const std::string objects = part(0);
		ASSERT_EQ(grows.Write(objects.data(), objects.size()), objects.size());
	}
	ASSERT_GT(fs::file_size(path("grows.rawlog")), 0U);
	EXPECT_GT(wait_for_lines(process, 1).size(), 0U) << "while the file is still open";
	grows.close();
	EXPECT_EQ(wait_for_lines(process, kRepeats * walk().size()).size(), kRepeats * walk().size());
	EXPECT_TRUE(process.running());
	fs::remove(path("grows.rawlog"));
	const auto result = process.wait();
	EXPECT_EQ(result.status, 0) << result.err;
}

TEST_F(AppStream, AnInterruptEndsTheWaitForMore)
{
	write_file(path("grows.rawlog"), part(0, 3));
	Process process = start(words(path("grows.rawlog"), {"--follow", "-o", path("out")}));
	wait_for_lines(process, 3);
	process.send(SIGINT);
	const auto result = process.wait();
	EXPECT_EQ(result.status, 130);
	EXPECT_NE(result.err.find("interrupted after 3 frames; these are in " + path("out")), std::string::npos)
	    << result.err;
	EXPECT_EQ(CsvTable(path("out/frames.csv"), kFramesHeader).size(), 3U);

	write_file(path("one.rawlog"), part(0, 1));
	fs::remove(path("stdout"));
	Process single = start(words(path("one.rawlog"), {"--follow"}));
	wait_for_lines(single, 1);
	single.send(SIGINT);
	EXPECT_EQ(single.wait().err, "rawlog-localize: interrupted after 1 frame\n");

	write_file(path("empty.rawlog"), "");
	fs::remove(path("stdout"));
	Process waiting = start(words(path("empty.rawlog"), {"--follow", "-o", path("new")}));
	while (!fs::exists(path("new"))) std::this_thread::sleep_for(std::chrono::milliseconds(1));
	waiting.send(SIGTERM);
	EXPECT_EQ(waiting.wait().status, 130);
}

TEST_F(AppStream, TheLaserOfTheFirstScanIsUsedUnlessAnotherIsNamed)
{
	save(
	    {walk_scan(0, "front"), walk_scan(1, "rear"), walk_scan(2, "front"), walk_scan(3, "rear"),
	     walk_scan(4, "rear")},
	    path("two.rawlog"));
	EXPECT_EQ(parse(run_with_input(path("two.rawlog"), words("-")).out).size(), 2U);
	EXPECT_EQ(parse(run_with_input(path("two.rawlog"), words("-", {"--sensor-label", "rear"})).out).size(), 3U);
}

TEST_F(AppStream, AReaderThatHasEnoughEndsTheStreamQuietly)
{
	Objects log;
	for (int i = 0; i < 20; i++)
		for (const auto& object : observation_log()) log.push_back(object);
	save(log, path("long.rawlog"));
	const auto head_of = [&](const Words& arguments)
	{
		const auto result =
		    run_program({"bash", "-c", command(arguments).substr(5) + " | head -n 1; exit ${PIPESTATUS[0]}"});
		EXPECT_EQ(result.status, 0);
		EXPECT_EQ(result.err, "");
		EXPECT_EQ(parse(result.out).size(), 1U);
	};
	head_of(words(path("long.rawlog")));
	head_of(words(path("long.rawlog"), {"--threads", "3"}));
	head_of(words(path("long.rawlog"), {"-o", path("out")}));  // whose files are wanted all the same
	EXPECT_EQ(lines_of(read_file(path("out/frames.csv"))).size(), 20 * walk().size() + 1);
	EXPECT_TRUE(fs::exists(path("out/summary.json")));
	const std::string full = command(words(path("long.rawlog"))) + " > /dev/full";
	expect_refused(run_program({"bash", "-c", full}), 3, {"standard output: cannot be written"});
}

/// The run would never end: a live log has no end of its own.
TEST_F(AppStream, AReaderThatHasEnoughEndsALiveLog)
{
	write_file(path("grows.rawlog"), part(0));
	write_file(path("more.rawlog"), part(0));
	const std::string grow =
	    "while sleep 0.1; do cat " + path("more.rawlog") + " >> " + path("grows.rawlog") + "; done & ";
	for (const Words& more : {Words{}, Words{"-o", path("out")}})
	{
		Words arguments = words(path("grows.rawlog"), {"--follow"});
		arguments.insert(arguments.end(), more.begin(), more.end());
		const auto result = run_program(
		    {"bash", "-c",
		     grow + command(arguments).substr(5) + " | head -n 1; status=${PIPESTATUS[0]}; kill %1; exit $status"});
		EXPECT_EQ(result.status, 0);
		EXPECT_EQ(result.err, "");
		EXPECT_EQ(parse(result.out).size(), 1U);
	}
	EXPECT_GT(CsvTable(path("out/frames.csv"), kFramesHeader).size(), 0U);
	EXPECT_TRUE(fs::exists(path("out/summary.json")));
}

TEST_F(AppStream, OptionsThatNeedAFolderOrAFileAreRefusedWithoutIt)
{
	for (const Words& option :
	     {Words{"--ground-truth", "truth.txt"}, Words{"--save-map", "a.signaturemap"},
	      Words{"--write-pf-ini", "pf.ini"}, Words{"--write-config", "a.ini"}})
		expect_refusal(words(path("walk.rawlog"), option), 1, {option[0], "--output"});
	expect_refusal(words("-", {"--follow"}), 1, {"--follow", "standard input"});
	for (const Words& live : {words("-"), words(path("walk.rawlog"), {"--follow"})})
	{
		Words arguments = live;
		arguments.push_back("--diagnose");
		expect_refusal(arguments, 1, {"--diagnose", "record it first"});
		arguments.back() = "--ground-truth";
		arguments.insert(arguments.end(), {"topic:/odom", "-o", path("out")});
		expect_refusal(arguments, 1, {"--ground-truth", "'topic:/odom'", "name a file of poses"});
	}
}
