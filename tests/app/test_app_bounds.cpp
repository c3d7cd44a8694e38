// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Inputs that are made to take all memory and time: one line or a result, soon and in little memory; and an interrupt
// is heard at any moment of any input.
#include <mrpt/img/CImage.h>
#include <zlib.h>

#include <chrono>
#include <csignal>
#include <random>
#include <thread>

#include "app_process.h"
#include "app_world.h"
#include "walk_logs.h"

using namespace d2s1r::test;
using Clock = std::chrono::steady_clock;

namespace
{
constexpr const char* kMapServer =
    "resolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

std::string big_endian(std::size_t number)
{
	std::string bytes;
	for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift & 0xFF);
	return bytes;
}

/// Returns a chunk of a PNG file.
std::string png_chunk(const std::string& type, const std::string& data)
{
	const std::string checked = type + data;
	const auto checksum =
	    crc32(0, reinterpret_cast<const unsigned char*>(checked.data()), static_cast<unsigned>(checked.size()));
	return big_endian(data.size()) + checked + big_endian(checksum);
}

/// Returns a text that unpacks to `size` bytes.
std::string deflated(std::size_t size)
{
	const std::string text(size, 'a');
	uLongf packed = compressBound(size);
	std::string bytes(packed, '\0');
	compress2(reinterpret_cast<Bytef*>(bytes.data()), &packed, reinterpret_cast<const Bytef*>(text.data()), size, 9);
	bytes.resize(packed);
	return bytes;
}

class AppBounds : public AppTest
{
   protected:
	AppBounds()
	{
		save_gridmap(flat(), path("flat.gridmap.gz"));
		save(observation_log(), path("walk.rawlog"));
	}

	Words words(const std::string& map, const std::string& log, const Words& more = {}) const
	{
		Words all = {"-m", path(map), "-i", path(log), "-o", path("out")};
		all.insert(all.end(), more.begin(), more.end());
		return all;
	}

	/// Runs the program on an input that is made to do harm.
	/// \param seconds [s] of processor time, at most
	ProcessResult run_limited(const Words& arguments, int seconds = 10) const
	{
		Words command = {"sh", "-c", "ulimit -t " + std::to_string(seconds) + "; exec \"$@\"", "sh", RAWLOG_LOCALIZE};
		command.insert(command.end(), arguments.begin(), arguments.end());
		return run_program(command);
	}

	/// Expects that an input is refused with one line, in little memory.
	/// \param most [kB] of memory
	void expect_refused_soon(const Words& arguments, const Words& parts, long most = kMostMemory) const
	{
		const ProcessResult result = run_limited(arguments);
		expect_refused(result, 2, parts);
		EXPECT_LT(result.memory, most) << result.err;
	}

	/// Saves an image of one room as a PNG, with texts and profiles that unpack to 8 MB each.
	void save_png_with_texts(const std::string& name, int texts) const
	{
		mrpt::img::CImage image(100, 100, mrpt::img::CH_GRAY);
		for (unsigned y = 0; y < 100; y++)
			for (unsigned x = 0; x < 100; x++)
				*image.ptr<std::uint8_t>(x, y) = x < 5 || y < 5 || x > 94 || y > 94 ? 0 : 254;
		ASSERT_TRUE(image.saveToFile(path(name)));
		std::string png = read_file(path(name));
		const std::string text = deflated(7'900'000);
		std::string chunks = png_chunk("iCCP", std::string("p\0\0", 3) + text);
		for (int i = 0; i < texts; i++)
			chunks += i % 2 == 0 ? png_chunk("zTXt", std::string("k\0\0", 3) + text)
			                     : png_chunk("iTXt", std::string("k\0\1\0\0\0", 6) + text);
		constexpr std::size_t kAfterHeader = 33;  // [byte]
		write_file(path(name), png.insert(kAfterHeader, chunks));
	}

	/// Saves a room of `side` pixels with pillars.
	void save_room(const std::string& name, int side) const
	{
		std::string pixels = "P5 " + std::to_string(side) + " " + std::to_string(side) + " 255\n";
		for (int y = 0; y < side; y++)
			for (int x = 0; x < side; x++)
				pixels += x < 3 || y < 3 || x > side - 4 || y > side - 4 || (x % 97 < 9 && y % 61 < 8) ? '\0' : '\xfe';
		write_file(path(name), pixels);
	}

	/// Saves a room of 8 m in the middle of specks as an image of `side` pixels.
	void save_specks(const std::string& name, int side) const
	{
		constexpr int kHalfRoom = 80;  // [pixel]
		std::mt19937 random(56);
		std::string pixels = "P5 " + std::to_string(side) + " " + std::to_string(side) + " 255\n";
		for (int y = 0; y < side; y++)
			for (int x = 0; x < side; x++)
			{
				const int beside = std::max(std::abs(x - side / 2), std::abs(y - side / 2));
				pixels += beside < kHalfRoom ? '\xfe' : random() % 2 == 0 ? '\0' : '\xcd';
			}
		write_file(path(name), pixels);
		write_file(path(name + ".yaml"), "image: " + name + "\n" + kMapServer);
	}

	/// Saves the walk `times` times in each format of logs that the program was built with. \return their names
	Words save_logs(int times) const
	{
		const auto repeated = [&](Wire wire)
		{
			std::vector<MadeMessage> all;
			for (int i = 0; i < times; i++)
				for (const MadeMessage& message : ros_walk(wire)) all.push_back(message);
			return all;
		};
		Objects objects;
		for (int i = 0; i < times; i++)
			for (const auto& object : observation_log()) objects.push_back(object);
		save(objects, path("long.rawlog"));
		std::string carmen;
		for (int i = 0; i < times; i++) carmen += carmen_walk();
		write_file(path("long.clf"), carmen);
		write_file(path("long.bag"), bag1_file(repeated(Wire::kRos1)));
		Words names = {"long.rawlog", "long.clf", "long.bag"};
#ifdef D2S1R_TF2
		write_file(path("long.mcap"), mcap_file(repeated(Wire::kCdr)));
		names.push_back("long.mcap");
#ifdef D2S1R_SQLITE
		save_sqlite_bag(path("long.db3"), repeated(Wire::kCdr));
		alter_sqlite_bag(path("long.db3"), "DROP INDEX timestamp_idx");
		names.push_back("long.db3");
#endif
#endif
		return names;
	}

	/// Saves inputs of all kinds, sound ones and such as are made to take long. \return the arguments of runs with them
	std::vector<Words> runs_of_all_kinds() const
	{
		constexpr int kTimes = 40;
		std::vector<Words> runs;
		for (const std::string& log : save_logs(kTimes)) runs.push_back(words("flat.gridmap.gz", log));
		const auto add = [&](const std::string& map, const Words& more = {}, const std::string& log = "long.rawlog")
		{ runs.push_back(words(map, log, more)); };
		add("flat.gridmap.gz", {"--fuse", "--window", "5"});
		add("flat.gridmap.gz", {"--merge-lasers", "--threads", "2"});
		add("flat.gridmap.gz", {"--stream"});
		add("flat.gridmap.gz", {"--diagnose"});
		save_truth(path("truth.txt"), false);
		add("flat.gridmap.gz", {"--ground-truth", path("truth.txt"), "--write-pf-ini", path("start.ini")});
		save_room("room.pgm", 3000);
		add("room.pgm", {"--resolution", "0.05", "--index", path("room.index")});
		write_file(path("room.yaml"), std::string("image: room.pgm\n") + kMapServer);
		write_file(path("atlas.yaml"), "maps: {a: {file: flat.gridmap.gz}, b: {file: room.yaml}}\n");
		add("atlas.yaml");
		save_png_with_texts("texts.png", 100);
		add("texts.png", {"--resolution", "0.05"});
		write_file(path("list.yaml"), "[" + std::string(250'000, ','));
		add("list.yaml");
		std::filesystem::create_directories(path("folder"));
		write_file(path("folder/metadata.yaml"), "[" + std::string(4'000'000, ','));
		add("flat.gridmap.gz", {}, "folder");
		write_file(path("garbage.rawlog"), read_file(path("long.rawlog")).insert(20'000, std::string(100, '\xff')));
		add("flat.gridmap.gz", {}, "garbage.rawlog");
		return runs;
	}

	static constexpr long kMostMemory = 400'000;  //!< [kB] a sound input of this size takes some 60,000
};

TEST_F(AppBounds, TextsInAPngAreNotUnpacked)
{
	save_png_with_texts("texts.png", 100);
	write_file(path("texts.yaml"), std::string("image: texts.png\n") + kMapServer);
	const ProcessResult result = run_limited(words("texts.yaml", "walk.rawlog"));
	EXPECT_EQ(result.status, 0) << result.err;
	EXPECT_LT(result.memory, kMostMemory);
}

TEST_F(AppBounds, YamlThatIsMadeToTakeMemoryIsRefused)
{
	std::string keys = "image: a.png\n";
	for (int i = 0; i < 100'000; i++) keys += "k" + std::to_string(i) + ": 1\n";
	write_file(path("keys.yaml"), keys);
	expect_refused_soon(words("keys.yaml", "walk.rawlog"), {"keys.yaml: is longer than 256 kB"});
	write_file(path("list.yaml"), "[" + std::string(250'000, ','));
	expect_refused_soon(words("list.yaml", "walk.rawlog"), {"list.yaml: line 1 is not yaml"});
	std::filesystem::create_directories(path("folder"));
	write_file(path("folder/metadata.yaml"), "[" + std::string(4'000'000, ','));
	expect_refused_soon(
	    words("flat.gridmap.gz", "folder"), {"metadata.yaml: is not the metadata of a ROS 2 bag"}, 800'000);
}

#ifdef D2S1R_TF2
/// A schema of an MCAP file is kept until the end, and packs to a thousandth of its name.
TEST_F(AppBounds, NamesOfTypesTakeNoMemory)
{
	if (!can_pack("zstd")) GTEST_SKIP() << "built without libzstd-dev";
	const auto made = []  // its memory is given back before the program is started, which would have it at first
	{
		std::vector<MadeMessage> messages = ros_walk(Wire::kCdr);
		for (int i = 0; i < 28; i++)
			messages.push_back({"/t" + std::to_string(i), std::string(16 << 20, 'x') + std::to_string(i), 0, "data"});
		return mcap_file(messages, {"zstd", 1, false});
	};
	write_file(path("types.mcap"), made());
	const ProcessResult result = run_limited(words("flat.gridmap.gz", "types.mcap"), 40);  // half a GB, some times
	EXPECT_EQ(result.status, 0) << result.err;
	EXPECT_LT(result.memory, kMostMemory);
}
#endif

/// A run may end by itself before the signal comes; then it is tried again, with a signal that comes sooner.
TEST_F(AppBounds, AnInterruptIsHeardAtAnyMomentOfAnyInput)
{
	const auto runs = runs_of_all_kinds();
	std::mt19937 random(56);
	std::uniform_real_distribution<double> logarithm(std::log(0.01), std::log(1.5));  // of the moment [s]
	const int cases = fault_cases(static_cast<int>(runs.size()), 200);
	int ended_alone = 0;
	double longest = 0;  // [s]
	for (int i = 0; i < cases; i++)
	{
		const Words& arguments = runs[static_cast<std::size_t>(i) % runs.size()];
		const std::string what = testing::PrintToString(arguments);
		for (double moment = std::exp(logarithm(random));; moment /= 2)
		{
			Process process = start(arguments);
			std::this_thread::sleep_for(std::chrono::duration<double>(moment));
			const bool runs_still = process.running();
			if (runs_still) process.send(SIGINT);
			const auto sent = Clock::now();
			const ProcessResult result = process.wait();
			if (!runs_still) continue;
			const double seconds = std::chrono::duration<double>(Clock::now() - sent).count();
			EXPECT_LT(seconds, 1) << "after " << moment << " s of " << what;
			longest = std::max(longest, seconds);
			if (result.status != 130) ended_alone++;  // as it ended when the signal came
			EXPECT_TRUE(result.status == 130 || result.status == 0 || result.status == 2)
			    << result.status << " after " << moment << " s of " << what << result.err;
			break;
		}
	}
	EXPECT_LE(ended_alone, 1 + cases / 20);
	std::printf("%d of %d with status 130, at most %.2f s after the signal\n", cases - ended_alone, cases, longest);
}

/// None of the scans fits, so that the program looks for the reason, which takes long in this map.
TEST_F(AppBounds, AnInterruptIsHeardWhileTheReasonIsLookedFor)
{
	save_specks("specks.pgm", 1000);
	Process process = start(words("specks.pgm.yaml", "walk.rawlog", {"--stream"}));
	const auto frames_done = [&]
	{ return std::filesystem::exists(path("stdout")) ? lines_of(read_file(path("stdout"))).size() : 0; };
	while (process.running() && frames_done() < walk().size())
		std::this_thread::sleep_for(std::chrono::milliseconds(5));
	std::this_thread::sleep_for(std::chrono::milliseconds(200));
	ASSERT_TRUE(process.running()) << "the map is too small for this test";
	process.send(SIGINT);
	const auto sent = Clock::now();
	const ProcessResult result = process.wait();
	EXPECT_LT(std::chrono::duration<double>(Clock::now() - sent).count(), 1);
	EXPECT_EQ(result.status, 130);
	const std::string all = std::to_string(walk().size());
	EXPECT_NE(result.err.find("interrupted after " + all + " of " + all + " frames"), std::string::npos) << result.err;
	EXPECT_TRUE(std::filesystem::exists(path("out/summary.json")));
}
}  // namespace
