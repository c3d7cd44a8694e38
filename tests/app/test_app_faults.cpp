// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Faults of the system and signals at bad moments: a clear line, the right exit status, nothing half-written.
#include <fcntl.h>
#include <mrpt/img/CImage.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/version.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "app_process.h"
#include "app_world.h"
#include "walk_logs.h"

using namespace d2s1r::test;
namespace fs = std::filesystem;
using std::chrono::duration;
using Clock = std::chrono::steady_clock;

class AppFaults : public AppTest
{
   protected:
	AppFaults()
	{
		save_gridmap(flat(), path("flat.gridmap.gz"));
		save(observation_log(), path("walk.rawlog"));
	}

	Words words(const std::string& map, const Words& more = {}) const { return words_for("walk.rawlog", map, more); }

	Words words_for(const std::string& log, const std::string& map, const Words& more = {}) const
	{
		Words all = {"-m", path(map), "-i", path(log), "-o", path("out")};
		all.insert(all.end(), more.begin(), more.end());
		return all;
	}

	/// Saves the walk in all formats of logs that the program was built with, and returns their names.
	Words save_logs() const
	{
		Words names = {"walk.rawlog", "walk.clf", "walk.clf.gz", "walk.bag"};
		write_file(path("walk.clf"), carmen_walk());
		mrpt::io::CFileGZOutputStream(path("walk.clf.gz")).Write(carmen_walk().data(), carmen_walk().size());
		write_file(path("walk.bag"), bag1_file(ros_walk(Wire::kRos1)));
		for (const char* method : {"bz2", "lz4", "zstd"})
		{
			if (!can_pack(method)) continue;
			names.push_back(std::string("walk_") + method + ".bag");
			write_file(path(names.back()), bag1_file(ros_walk(Wire::kRos1), {method}));
		}
		if (can_pack("bz2"))
		{
			names.push_back("walk.clf.bz2");
			write_file(path(names.back()), packed("bz2", carmen_walk()));
		}
		names.push_back("walk.mcap");
		write_file(path(names.back()), mcap_file(ros_walk(Wire::kCdr)));
#ifdef D2S1R_SQLITE
		names.push_back("walk.db3");
		save_sqlite_bag(path(names.back()), ros_walk(Wire::kCdr));
#endif
		return names;
	}

	/// Runs the program with calls that fail. \param failure such as "D2S1R_FAIL_NEW=7"
	ProcessResult run_failing(const std::string& failure, const Words& arguments) const
	{
		return run_failing(failure, Words{}, arguments);
	}

	/// Runs the program with calls that fail, and with another variable of the environment.
	ProcessResult run_failing(const std::string& failure, const Words& variables, const Words& arguments) const
	{
		Words command = {"env", "LD_PRELOAD=" FAILING_CALLS, failure};
		command.insert(command.end(), variables.begin(), variables.end());
		command.push_back(RAWLOG_LOCALIZE);
		command.insert(command.end(), arguments.begin(), arguments.end());
		return run_program(command);
	}

	/// Waits until the program has opened its outputs, which it does before it reads anything.
	void wait_for_outputs(Process& process) const
	{
		while (process.running() && !fs::exists(path("out"))) std::this_thread::sleep_for(std::chrono::milliseconds(1));
	}

	/// The same as a PNG of grey values.
	void save_png(const std::string& name, int side) const
	{
		mrpt::img::CImage image(static_cast<unsigned>(side), static_cast<unsigned>(side), mrpt::img::CH_GRAY);
		for (int y = 0; y < side; y++)
			for (int x = 0; x < side; x++)
				image.ptrLine<std::uint8_t>(static_cast<unsigned>(y))[x] = is_wall(x, y, side) ? 0 : 254;
		ASSERT_TRUE(image.saveToFile(path(name)));
	}

	static bool is_wall(int x, int y, int side)
	{
		return x < 2 || y < 2 || x >= side - 2 || y >= side - 2;
	}

	/// A white image of so many pixels a side, with a wall around.
	void save_image(const std::string& name, int side) const
	{
		std::string pixels = "P5\n" + std::to_string(side) + " " + std::to_string(side) + "\n255\n";
		for (int y = 0; y < side; y++)
			for (int x = 0; x < side; x++) pixels += is_wall(x, y, side) ? '\0' : '\xfe';
		write_file(path(name), pixels);
	}
};

TEST_F(AppFaults, AReadErrorIsNotTakenForTheEndOfTheGroundTruth)
{
	save_truth(path("truth.txt"), false);
	const auto size = fs::file_size(path("truth.txt"));
	const Words arguments = words("flat.gridmap.gz", {"--ground-truth", path("truth.txt")});
	for (const auto byte : {std::uintmax_t(0), size / 2, size - 1})
	{
		expect_refused(
		    run_failing("D2S1R_FAIL_READ=/truth.txt:" + std::to_string(byte), arguments), 2,
		    {path("truth.txt") + ": cannot be read to its end (Input/output error)"});
		EXPECT_FALSE(fs::exists(path("out"))) << byte;
	}
	expect_refusal(
	    words("flat.gridmap.gz", {"--ground-truth", folder().string()}), 2,
	    {"cannot be read to its end (Is a directory)"});
}

TEST_F(AppFaults, AReadErrorInALogOrMapIsTold)
{
	save_image("hall.pgm", 120);
	save_png("hall.png", 120);
	Words names = save_logs();
	names.insert(names.end(), {"hall.pgm", "hall.png", "flat.gridmap.gz"});
	for (const std::string& name : names)
	{
		const bool is_image = name.rfind("hall", 0) == 0, is_log = name.rfind("walk", 0) == 0;
		Words arguments = words_for(is_log ? name : "walk.rawlog", is_image ? name : "flat.gridmap.gz", {"-q"});
		if (is_image) arguments.insert(arguments.end(), {"--resolution", "0.1"});
		const auto size = fs::file_size(path(name));
		const auto cases = static_cast<std::uintmax_t>(fault_cases(4, 70));
		for (std::uintmax_t i = 0; i < cases; i++)
		{
			fs::remove_all(path("out"));
			const auto byte = i * size / cases;
			const auto result = run_failing("D2S1R_FAIL_READ=/" + name + ":" + std::to_string(byte), arguments);
			EXPECT_EQ(result.status, 2) << name << " at byte " << byte;
			EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err << name << " at byte " << byte;
			EXPECT_NE(result.err.find(path(name)), std::string::npos) << result.err;
			EXPECT_NE(result.err.find("(Input/output error)"), std::string::npos) << result.err << "at byte " << byte;
			for (const char* blame : {"damaged", "defect"})
				EXPECT_EQ(result.err.find(blame), std::string::npos) << result.err << "at byte " << byte;
			if (!fs::exists(path("out"))) continue;  // frames before the error are kept
			EXPECT_TRUE(is_log) << name << " at byte " << byte;
			EXPECT_TRUE(fs::exists(path("out/summary.json"))) << byte;
		}
	}
}

TEST_F(AppFaults, InputsThatChangeDuringTheRunCostALineAtMost)
{
	const std::string log = read_file(path("walk.rawlog")), map = read_file(path("flat.gridmap.gz"));
	const int cases = fault_cases(6, 60);
	for (int i = 0; i < cases; i++)
	{
		fs::remove_all(path("out"));
		write_file(path("walk.rawlog"), log);
		write_file(path("flat.gridmap.gz"), map);
		Process process = start(words("flat.gridmap.gz", {"-q"}));
		std::this_thread::sleep_for(std::chrono::milliseconds(40 + 13 * i % 300));
		switch (i % 3)
		{
			case 0:
				fs::resize_file(path("walk.rawlog"), log.size() * static_cast<std::size_t>(1 + i % 7) / 9);
				break;
			case 1:
				write_file(path("walk.rawlog"), log.substr(log.size() / 3) + log);
				break;
			default:
				fs::remove(path("walk.rawlog"));
				write_file(path("flat.gridmap.gz"), map.substr(map.size() / 2));
		}
		const auto result = process.wait();
		EXPECT_TRUE(result.status == 0 || result.status == 2)
		    << result.status << ": " << result.err << " in case " << i;
		EXPECT_EQ(lines_of(result.err).size(), result.status == 0 ? 0U : 1U) << result.err << " in case " << i;
		EXPECT_EQ(result.err.find("defect"), std::string::npos) << result.err << " in case " << i;
		const bool is_whole = !fs::exists(path("out")) || fs::exists(path("out/summary.json"));
		EXPECT_TRUE(is_whole) << "in case " << i;
	}
}

TEST_F(AppFaults, AnAllocationThatFailsIsToldAsThat)
{
	const Words all_logs = save_logs();
	for (const std::string& log : {std::string("walk.rawlog"), std::string("walk.clf.gz"), all_logs.back()})
	{
		const Words arguments = words_for(log, "flat.gridmap.gz", {"-q"});
		run_failing("D2S1R_COUNT=" + path("count"), arguments);
		const long count = std::stol(read_file(path("count")));
		ASSERT_GT(count, 1000) << log;
		int failed = 0;
		const int cases = fault_cases(12, 300);
		for (int i = 0; i < cases; i++)
		{
			fs::remove_all(path("out"));
			const long call = 1 + i * count / cases + 37 * i % 101;
			const std::string where = " of " + log + " at call " + std::to_string(call);
			const auto result = run_failing("D2S1R_FAIL_NEW=" + std::to_string(call), arguments);
			if (result.status == 0) continue;
			failed++;
			EXPECT_EQ(result.status, 2) << where;
			EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err << where;
			EXPECT_NE(result.err.find("memory"), std::string::npos) << result.err << where;
			for (const char* blame : {"cut short", "defect"})
				EXPECT_EQ(result.err.find(blame), std::string::npos) << result.err << where;
			if (!fs::exists(path("out"))) continue;
			for (const auto& entry : fs::directory_iterator(path("out")))  // of a library that lets nothing pass
				EXPECT_EQ(entry.path().filename().string().rfind(".tmp", 0), 0U) << entry.path() << where;
		}
		EXPECT_GT(failed, cases / 2) << log;
	}
}

TEST_F(AppFaults, AMallocThatFailsIsToldAsThat)
{
	save_png("hall.png", 400);
	const Words arguments = words("hall.png", {"-q", "--resolution", "0.05"});
	ASSERT_EQ(run(words("flat.gridmap.gz", {"-q", "--frames", ":2"})).status, 0);
	const std::string earlier = read_file(path("out/frames.csv"));
	const auto check = [&](const std::string& failing)
	{
		const auto result = run_failing("D2S1R_FAIL_MALLOC=" + failing, arguments);
		if (result.status == 0) return false;
		EXPECT_EQ(result.status, 2) << failing << ": " << result.err;
		EXPECT_EQ(lines_of(result.err).size(), 1U) << failing << ": " << result.err;
		EXPECT_NE(result.err.find("memory"), std::string::npos) << failing << ": " << result.err;
		for (const char* blame : {"cut short", "decoded", "written", "defect"})
			EXPECT_EQ(result.err.find(blame), std::string::npos) << failing << ": " << result.err;
		EXPECT_EQ(read_file(path("out/frames.csv")), earlier) << failing;
		return true;
	};
	int failed = 0;
	for (const char* least : {"30000", "150000", "1000000", "4000000"})
		failed += check(std::string(least) + ":2000000000:0");
	EXPECT_GE(failed, 4);
	// a buffer or a window of zlib; more than what the decoders, the reader of the log or cairo ask for
	for (const std::string sizes : {"30000:70000:", "100000:2000000000:"})
	{
		run_failing("D2S1R_FAIL_MALLOC=" + sizes + "999999", Words{"D2S1R_COUNT=" + path("count")}, arguments);
		long count = 0;
		ASSERT_TRUE(std::ifstream(path("count")) >> count >> count);
		ASSERT_GT(count, 3);
		write_file(path("out/frames.csv"), earlier);
		const long cases = std::min<long>(count, fault_cases(15, 300));
		for (long i = 0; i < cases; i++)
			if (!check(sizes + std::to_string(1 + i * count / cases))) write_file(path("out/frames.csv"), earlier);
	}
}

TEST_F(AppFaults, MemoryThatRunsOutWhileALogIsReadIsNotTakenForDamageOfIt)
{
	for (const std::string& log : save_logs())
	{
		if (log == "walk.rawlog" || log == "walk.bag") continue;  // nothing of theirs takes that much memory at once
		const Words arguments = words_for(log, "flat.gridmap.gz", {"-q"});
		const std::string sizes = "D2S1R_FAIL_MALLOC=60000:2000000000:";  // what unpacks chunks, and blocks of text
		run_failing(sizes + "999999", Words{"D2S1R_COUNT=" + path("count")}, arguments);
		long count = 0;
		ASSERT_TRUE(std::ifstream(path("count")) >> count >> count);
		const long last = std::min<long>(count, fault_cases(9, 1000));
		for (long call = fault_cases(5, 1); call <= last; call++)  // the first ones are of the program's start
		{
			fs::remove_all(path("out"));
			const auto result = run_failing(sizes + std::to_string(call), arguments);
			if (result.status == 0) continue;
			const std::string where = result.err + " of " + log + " at call " + std::to_string(call);
			EXPECT_EQ(result.status, 2) << where;
			EXPECT_EQ(lines_of(result.err).size(), 1U) << where;
			EXPECT_NE(result.err.find("memory"), std::string::npos) << where;
			for (const char* blame : {"cut short", "defect"})
				EXPECT_EQ(result.err.find(blame), std::string::npos) << where;
			EXPECT_FALSE(fs::exists(path("out/summary.json"))) << where;
		}
	}
}

TEST_F(AppFaults, TooLittleMemoryIsToldAsThat)
{
	const auto run_within = [&](int megabytes, const std::string& arguments)
	{
		return run_program(
		    {"bash", "-c",
		     "ulimit -c 0; ulimit -v " + std::to_string(1000 * megabytes) + "; exec " RAWLOG_LOCALIZE " " + arguments});
	};
	int least = 100;  // [MB] that the program takes to start
	while (run_within(least, "--version").status != 0 && least < 2000) least += 4;
	int failed = 0;
	for (int megabytes = least + 8; failed < 200; megabytes += fault_cases(4, 2))
	{
		const auto result = run_within(
		    megabytes, "-q -m " + path("flat.gridmap.gz") + " -i " + path("walk.rawlog") + " -o " + path("out"));
		if (result.status == 0) break;
		failed++;
		EXPECT_EQ(result.status, 2) << result.err << " with " << megabytes << " MB";
		EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err << " with " << megabytes << " MB";
		EXPECT_NE(result.err.find("memory"), std::string::npos) << result.err << " with " << megabytes << " MB";
		EXPECT_FALSE(fs::exists(path("out"))) << megabytes;
	}
	if (MRPT_VERSION >= 0x030000 && failed == 0) GTEST_SKIP() << "MRPT 3 takes more memory to start than the run does";
	EXPECT_GT(failed, 1);
}

TEST_F(AppFaults, AnInterruptEndsTheLoadingAndIndexingOfALargeMapWithinASecond)
{
	save_image("hall.pgm", 5000);  // 62,500 m^2
	for (const int milliseconds : {50, 1500})
	{
		Process process = start(words("hall.pgm", {"--resolution", "0.05"}));
		wait_for_outputs(process);
		std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
		ASSERT_TRUE(process.running()) << "the map is too small for this test";
		process.send(SIGINT);
		const auto sent = Clock::now();
		const auto result = process.wait();
		EXPECT_LT(duration<double>(Clock::now() - sent).count(), 1) << "after " << milliseconds << " ms";
		EXPECT_EQ(result.status, 130);
		EXPECT_NE(result.err.find("interrupted before the first frame; no results are written"), std::string::npos)
		    << result.err;
		EXPECT_FALSE(fs::exists(path("out")));
	}
}

TEST_F(AppFaults, ATerminalIsToldThatTheIndexIsBuilt)
{
	save_image("hall.pgm", 1500);
	std::string command = RAWLOG_LOCALIZE;
	for (const auto& word : words("hall.pgm", {"--resolution", "0.05"})) command += " " + word;
	const auto result = run_program({"script", "-qec", command, "/dev/null"});
	if (result.status == 127) GTEST_SKIP() << "script is missing: install bsdutils";
	EXPECT_NE(result.out.find("loading the map"), std::string::npos) << result.out;
	EXPECT_NE(result.out.find("building the index of the map, 0 s"), std::string::npos) << result.out;
}

TEST_F(AppFaults, ALaterInterruptEndsAtOnceWhatTheFirstOneDidNot)
{
	const std::string hanging = path("hanging");
	Words command = {"env", "LD_PRELOAD=" FAILING_CALLS, "D2S1R_HANG_RENAME=" + hanging, RAWLOG_LOCALIZE};
	for (const auto& word : words("flat.gridmap.gz")) command.push_back(word);
	Process process(command, folder());
	while (process.running() && !fs::exists(hanging)) std::this_thread::sleep_for(std::chrono::milliseconds(10));
	for (const int signal : {SIGINT, SIGTERM, SIGHUP})
	{
		process.send(signal);
		std::this_thread::sleep_for(std::chrono::milliseconds(100));
	}
	EXPECT_TRUE(process.running()) << "signals at once are one wish, and results are being written";
	std::this_thread::sleep_for(std::chrono::milliseconds(500));
	process.send(SIGINT);
	const auto sent = Clock::now();
	EXPECT_EQ(process.wait().status, 130);
	EXPECT_LT(duration<double>(Clock::now() - sent).count(), 1);
	EXPECT_FALSE(fs::exists(path("out/summary.json")));
}

TEST_F(AppFaults, AnInterruptEndsTheWaitForAPipe)
{
	ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
	for (const auto& [option, has_writer] :
	     {std::pair("-c", true), {"--ground-truth", true}, {"--ground-truth", false}})
	{
		Process process = start(words("flat.gridmap.gz", {option, path("pipe")}));
		int writer = -1;
		if (has_writer)
			while (process.running() && writer < 0)  // it can be opened once somebody reads
				writer = open(path("pipe").c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
		else
			wait_for_outputs(process);
		std::this_thread::sleep_for(std::chrono::milliseconds(300));
		ASSERT_TRUE(process.running());
		process.send(SIGINT);
		const auto sent = Clock::now();
		while (process.running() && Clock::now() - sent < std::chrono::seconds(10)) std::this_thread::yield();
		EXPECT_FALSE(process.running()) << option;
		if (process.running()) process.send(SIGKILL);
		expect_refused(process.wait(), 130, {": interrupted before the first frame; no results are written"});
		EXPECT_FALSE(fs::exists(path("out"))) << option;
		close(writer);
	}
}

TEST_F(AppFaults, AnIndexThatIsCutWhileItIsUsedIsToldAsThat)
{
	const Words at_rest = words("flat.gridmap.gz", {"-q", "--index", path("flat.index")});
	ASSERT_EQ(run(at_rest).status, 0);
	Words words_of_live = at_rest;
	words_of_live.insert(words_of_live.end(), {"--follow", "--stream"});
	const std::string scans = read_file(path("walk.rawlog"));
	Process process = start(words_of_live);
	while (process.running() && lines_of(read_file(path("stdout"))).size() < walk().size())
		std::this_thread::sleep_for(std::chrono::milliseconds(1));
	fs::resize_file(path("flat.index"), 0);
	std::ofstream(path("walk.rawlog"), std::ios::app | std::ios::binary) << scans;
	const auto result = process.wait();
	EXPECT_EQ(result.status, 2);
	EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
	EXPECT_EQ(result.err.rfind("rawlog-localize: the file of --index, or another one", 0), 0U) << result.err;

	EXPECT_EQ(run(at_rest).status, 0) << "the index is built again";
	for (const auto& entry : fs::directory_iterator(path("out")))
		EXPECT_NE(entry.path().filename().string().rfind(".tmp", 0), 0U) << entry.path();
}

TEST_F(AppFaults, WhatAKilledRunLeftOfAnIndexIsRemovedByTheNextOne)
{
	const auto left = [&]
	{
		std::size_t files = 0;
		for (const auto& entry : fs::directory_iterator(folder()))
			files += entry.path().filename().string().rfind(".tmp", 0) == 0 ? 1 : 0;
		return files;
	};
	const Words arguments = words("flat.gridmap.gz", {"-q", "--index", path("flat.index")});
	Words command = {"env", "LD_PRELOAD=" FAILING_CALLS, "D2S1R_HANG_RENAME=" + path("hanging"), RAWLOG_LOCALIZE};
	command.insert(command.end(), arguments.begin(), arguments.end());
	for (const bool has_index : {false, true})
	{
		fs::remove(path("hanging"));
		write_file(path("own.ini"), has_index ? "[coarse_search]\nspacing = 0.3\n" : "");
		Words with_config = command;
		with_config.insert(with_config.end(), {"-c", path("own.ini")});
		Process process(with_config, folder());  // the index is what is renamed first
		while (process.running() && !fs::exists(path("hanging")))
			std::this_thread::sleep_for(std::chrono::milliseconds(1));
		EXPECT_EQ(left(), 1U);
		EXPECT_EQ(run(arguments).status, 0);
		EXPECT_EQ(left(), 1U) << "it is still being written";
		process.send(SIGKILL);
		process.wait();
		EXPECT_EQ(run(arguments).status, 0);
		EXPECT_EQ(left(), 0U);
		EXPECT_TRUE(fs::exists(path("flat.index")));
	}
}

TEST_F(AppFaults, LabelsThatControlATerminalArePrintedWithoutThat)
{
	const std::string escape = "\x1b[31mred\r\n\x07\xc2\x9b";
	save({walk_scan(0, escape), walk_scan(1, escape), walk_scan(2, "other")}, path("walk.rawlog"));
	const auto result = run(words("flat.gridmap.gz"));
	EXPECT_EQ(result.status, 0);
	EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
	EXPECT_NE(result.err.find("?[31mred????"), std::string::npos) << result.err;
	for (const char control : {'\x1b', '\r', '\x07', '\x9b'})
		EXPECT_EQ(result.err.find(control), std::string::npos) << result.err;
	const auto named = run(words("flat.gridmap.gz", {"--sensor-label", "none\x1b[0m"}));
	EXPECT_EQ(named.status, 1);
	EXPECT_EQ(named.err.find('\x1b'), std::string::npos) << named.err;
}
