// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Bags of ROS 1 and ROS 2 and MCAP files: whatever the packing, the same messages in order; damage is told.
#include <logs/errors.h>

#include "app/temporary_folder.h"
#include "bags/message_source.h"
#include "logs/made_logs.h"

#ifdef D2S1R_SQLITE
#include <sqlite3.h>
#endif
#include <sys/resource.h>

#include <csignal>
#include <optional>
#include <random>

using namespace d2s1r::test;
using namespace d2s1r::logs;

namespace
{
constexpr std::int64_t kSecond = 1'000'000'000;

/// Ten scans with other messages between them, which are not read.
std::vector<MadeMessage> recording(Wire wire)
{
	std::vector<MadeMessage> messages;
	for (std::int64_t i = 0; i < 10; i++)
	{
		MadeScan scan;
		scan.time = 1600 * kSecond + i * kSecond / 10;
		messages.push_back(made_scan(wire, scan));
		messages.push_back({"/chatter", "std_msgs/String", scan.time + 1, FieldWriter(wire).text("hello").bytes()});
	}
	return messages;
}

std::vector<std::int64_t> times_of(const std::vector<MadeMessage>& messages)
{
	std::vector<std::int64_t> times;
	for (const auto& message : messages)
		if (message.topic != "/chatter") times.push_back(message.time);
	return times;
}

struct Reading
{
	std::vector<std::int64_t> times;
	std::vector<std::string> topics;
	std::vector<std::string> data;
	std::string damage;
};

Reading read_all(MessageSource& source)
{
	Reading reading;
	while (const auto message = source.next())
	{
		reading.times.push_back(message->time);
		reading.topics.push_back(message->topic->name);
		reading.data.emplace_back(reinterpret_cast<const char*>(message->data.data), message->data.size);
	}
	EXPECT_FALSE(source.next());  // nor does it start again
	reading.damage = source.damage();
	return reading;
}
}  // namespace

class MessageSources : public FolderTest
{
   protected:
	Reading read_file(const std::string& content, RosFormat format) const
	{
		write("log", content);
		const auto source = open_messages(path("log"), format);
		return read_all(*source);
	}

	/// Reads a file and returns what is wrong with it; it may hold more than one would keep.
	std::string damage_of(const std::string& content, RosFormat format) const
	{
		write("log", content);
		const auto source = open_messages(path("log"), format);
		while (source->next()) EXPECT_EQ(source->damage(), "") << "is told after all that was read";
		return source->damage();
	}

	/// Expects that whatever is cut off or altered, the reading ends, and that nothing of it was made up.
	void expect_no_harm(const std::string& whole, RosFormat format) const
	{
		std::mt19937 random(7);  // NOLINT: the same bytes each time
		const auto below = [&](std::size_t limit) { return random() % limit; };
		for (int i = 0; i < 300; i++)
		{
			std::string file = whole;
			if (i % 3 == 0)
				file.resize(below(file.size()));
			else
				for (int j = 0; j < 4; j++) file[below(file.size())] = static_cast<char>(below(256));
			try
			{
				EXPECT_LE(read_file(file, format).times.size(), 10000U);
			}
			catch (const LogError& e)
			{
			}
		}
	}
};

TEST_F(MessageSources, BagsOfRos1GiveTheirMessagesWhateverThePacking)
{
	const auto messages = recording(Wire::kRos1);
	for (const std::string method : {"", "bz2", "lz4"})
	{
		if (!method.empty() && !can_pack(method)) continue;
		const Reading reading = read_file(bag1_file(messages, {method}), RosFormat::kBag1);
		EXPECT_EQ(reading.times, times_of(messages)) << method;
		EXPECT_EQ(reading.data[3], messages[6].data) << method;
		EXPECT_EQ(reading.topics[3], "/scan") << method;
		EXPECT_EQ(reading.damage, "") << method;
	}
}

TEST_F(MessageSources, McapFilesGiveTheirMessagesWhateverThePacking)
{
	const auto messages = recording(Wire::kCdr);
	for (const std::string method : {"", "lz4", "zstd"})
		for (const std::size_t in_chunk : {0U, 1U, 3U, 100U})
			for (const bool with_index : {false, true})
			{
				if (!method.empty() && !can_pack(method)) continue;
				const Reading reading =
				    read_file(mcap_file(messages, {method, in_chunk, with_index}), RosFormat::kMcap);
				EXPECT_EQ(reading.times, times_of(messages)) << method << " " << in_chunk;
				EXPECT_EQ(reading.data[3], messages[6].data) << method << " " << in_chunk;
				EXPECT_EQ(reading.damage, "") << method << " " << in_chunk;
			}
}

TEST_F(MessageSources, SqliteBagsGiveTheirMessagesByTime)
{
#ifndef D2S1R_SQLITE
	GTEST_SKIP() << "built without libsqlite3-dev";
#endif
	auto messages = recording(Wire::kCdr);
	const auto times = times_of(messages);
	std::reverse(messages.begin(), messages.end());
	save_sqlite_bag(path("log"), messages);
	const Reading reading = read_all(*open_messages(path("log"), RosFormat::kSqlite));
	EXPECT_EQ(reading.times, times);
	EXPECT_EQ(reading.data[0], messages.back().topic == "/scan" ? messages.back().data : messages[18].data);
	EXPECT_EQ(reading.damage, "");
}

TEST_F(MessageSources, ChunksInAnyOrderGiveMessagesByTime)
{
	const Packing shuffled{"", 5, true, {2, 0, 3, 1}};
	const auto ros1 = recording(Wire::kRos1), cdr = recording(Wire::kCdr);
	EXPECT_EQ(read_file(bag1_file(ros1, shuffled), RosFormat::kBag1).times, times_of(ros1));
	EXPECT_EQ(read_file(mcap_file(cdr, shuffled), RosFormat::kMcap).times, times_of(cdr));
}

TEST_F(MessageSources, ChunksThatOverlapInTimeGiveMessagesByTime)
{
	auto messages = recording(Wire::kCdr);
	const auto times = times_of(messages);
	std::swap(messages[0], messages[18]);  // the first chunk holds the first time and the last, out of order
	std::swap(messages[4], messages[14]);
	EXPECT_EQ(read_file(mcap_file(messages, {"", 4}), RosFormat::kMcap).times, times);
	EXPECT_EQ(read_file(mcap_file(messages, {"", 0}), RosFormat::kMcap).times, times);
}

TEST_F(MessageSources, ChunksOfABagWithoutAnIndexAreReadAllTheSame)
{
	const auto messages = recording(Wire::kRos1);
	const Reading reading = read_file(bag1_file(messages, {"", 5, false, {1, 0, 2, 3}}), RosFormat::kBag1);
	EXPECT_EQ(reading.times, times_of(messages));
	EXPECT_EQ(reading.damage, "");
}

TEST_F(MessageSources, IndexOfEarlyRecordersHasTooLargeASize)
{
	const auto messages = recording(Wire::kRos1);
	std::string bag = bag1_file(messages, {"", 20});
	const auto index = bag.rfind("op=\x04");  // of ten scans, then of ten other messages
	const auto size = bag.find(std::string("\x78\0\0\0", 4), index);
	ASSERT_NE(size, std::string::npos);
	bag[size] = '\xc8';  // 20 bytes an entry, where 12 are there
	const Reading reading = read_file(bag, RosFormat::kBag1);
	EXPECT_EQ(reading.times, times_of(messages));
	EXPECT_EQ(reading.damage, "");
}

TEST_F(MessageSources, FilesThatEndTooEarlyGiveTheMessagesBeforeThatAndSaySo)
{
	const std::string bag = bag1_file(recording(Wire::kRos1), {"", 5});
	const Reading of_bag = read_file(bag.substr(0, bag.size() - bag.size() / 5), RosFormat::kBag1);
	EXPECT_GE(of_bag.times.size(), 5U);
	EXPECT_LT(of_bag.times.size(), 10U);
	EXPECT_NE(of_bag.damage.find("it ends within a record"), std::string::npos) << of_bag.damage;

	const std::string mcap = mcap_file(recording(Wire::kCdr), {"", 5});
	const Reading of_mcap = read_file(mcap.substr(0, mcap.size() / 2), RosFormat::kMcap);
	EXPECT_GE(of_mcap.times.size(), 2U);
	EXPECT_NE(of_mcap.damage.find("it ends within a record"), std::string::npos) << of_mcap.damage;
}

TEST_F(MessageSources, ChunkOfAnMcapFileWithAnotherChecksumIsDamaged)
{
	std::string file = mcap_file(recording(Wire::kCdr), {"", 100});
	const auto place = file.find("laser", file.size() / 2);
	file[place] = 'L';
	const Reading reading = read_file(file, RosFormat::kMcap);
	EXPECT_TRUE(reading.times.empty());
	EXPECT_NE(reading.damage.find("checksum"), std::string::npos) << reading.damage;
}

TEST_F(MessageSources, PackingThatIsNotKnownIsNamed)
{
	std::string bag = bag1_file(recording(Wire::kRos1));
	for (auto at = bag.find("=none"); at != std::string::npos; at = bag.find("=none")) bag.replace(at, 5, "=mine");
	const Reading reading = read_file(bag, RosFormat::kBag1);
	EXPECT_EQ(reading.damage.rfind("is packed by 'mine', which is not known", 0), 0U) << reading.damage;
}

TEST_F(MessageSources, OldBagsAreRefusedByTheirVersion)
{
	try
	{
		read_file("#ROSRECORD V1.2\nsomething", RosFormat::kBag1);
		FAIL() << "was read";
	}
	catch (const LogError& e)
	{
		EXPECT_NE(std::string(e.what()).find("of version V1.2, but only V2.0 is read"), std::string::npos) << e.what();
	}
}

TEST_F(MessageSources, SqliteFileThatIsNoBagIsRefused)
{
#ifndef D2S1R_SQLITE
	GTEST_SKIP() << "built without libsqlite3-dev";
#endif
	write("log", std::string("SQLite format 3\0", 16) + std::string(500, 'x'));
	EXPECT_THROW(open_messages(path("log"), RosFormat::kSqlite), LogError);
}

TEST_F(MessageSources, FolderGivesItsFilesOneAfterTheOther)
{
	const auto messages = recording(Wire::kCdr);
	const std::vector<MadeMessage> first(messages.begin(), messages.begin() + 8),
	    rest(messages.begin() + 8, messages.end());
	write("a_0.mcap", mcap_file(first));
	write("a_1.mcap", mcap_file(rest));
	write(
	    "metadata.yaml",
	    "rosbag2_bagfile_information:\n  relative_file_paths:\n    - a_0.mcap\n    - old_folder/a_1.mcap\n");
	const Reading reading = read_all(*open_messages(path(""), RosFormat::kFolder));
	EXPECT_EQ(reading.times, times_of(messages));
	EXPECT_EQ(reading.damage, "");
}

TEST_F(MessageSources, FolderWithoutMetadataGivesItsFilesInTheOrderOfTheirNumbers)
{
	const auto messages = recording(Wire::kCdr);
	for (std::size_t i = 0; i < messages.size(); i++)
		write("bag_" + std::to_string(i) + ".mcap", mcap_file({messages[i]}));
	ASSERT_GT(messages.size(), 10U) << "bag_10 comes after bag_9";
	write("notes.txt", "not a recording");
	EXPECT_EQ(read_all(*open_messages(path(""), RosFormat::kFolder)).times, times_of(messages));
	write("bag_0.db3", "another one");
	EXPECT_THROW(open_messages(path(""), RosFormat::kFolder), LogError);
}

TEST_F(MessageSources, FolderMayHoldABagOfRos1ThatWasSplit)
{
	const auto messages = recording(Wire::kRos1);
	for (std::size_t i = 0; i < messages.size(); i++)
		write("drive_" + std::to_string(i) + ".bag", bag1_file({messages[i]}));
	EXPECT_EQ(read_all(*open_messages(path(""), RosFormat::kFolder)).times, times_of(messages));
}

TEST_F(MessageSources, FolderOfPackedFilesSaysSo)
{
	write("a_0.mcap.zstd", "packed");
	try
	{
		files_of_bag(path(""));
		FAIL() << "was read";
	}
	catch (const LogError& e)
	{
		EXPECT_NE(std::string(e.what()).find("a_0.mcap.zstd: is packed"), std::string::npos);
	}
}

TEST_F(MessageSources, ScansOfATypeThatIsNotReadAreNamed)
{
	const auto unread = [&](const std::string& content, RosFormat format)
	{
		write("log", content);
		const auto source = open_messages(path("log"), format);
		read_all(*source);
		return source->unread_scans();
	};
	EXPECT_EQ(
	    unread(mcap_file({{"/scan", "foxglove.LaserScan", 1, "{}"}}, {}, "json"), RosFormat::kMcap),
	    "foxglove.LaserScan in json on the topic '/scan'");
	EXPECT_EQ(
	    unread(bag1_file({{"/top", "my_msgs/LaserScanNew", 1, ""}}), RosFormat::kBag1),
	    "my_msgs/LaserScanNew on the topic '/top'");
	EXPECT_EQ(unread(mcap_file(recording(Wire::kCdr)), RosFormat::kMcap), "");
}

TEST_F(MessageSources, FilesThatWerePackedAsAWholeAreReadWhereTheyHaveBeenUnpacked)
{
	const auto messages = recording(Wire::kCdr);
	write("metadata.yaml", "rosbag2_bagfile_information:\n  relative_file_paths: [a_0.mcap.zstd]\n");
	write("a_0.mcap.zstd", std::string("\x28\xb5\x2f\xfd", 4) + std::string(20, 'x'));
	try
	{
		read_all(*open_messages(path(""), RosFormat::kFolder));
		FAIL() << "was read";
	}
	catch (const LogError& e)
	{
		EXPECT_NE(
		    std::string(e.what()).find(
		        "a_0.mcap.zstd: is packed, but is read in any order; unpack all files of the folder"),
		    std::string::npos);
	}
	write("a_0.mcap", mcap_file(messages));
	EXPECT_EQ(read_all(*open_messages(path(""), RosFormat::kFolder)).times, times_of(messages));
}

TEST(KindOfType, IsTheSameInEverySpelling)
{
	for (const char* type :
	     {"sensor_msgs/LaserScan", "sensor_msgs/msg/LaserScan", "sensor_msgs::msg::LaserScan",
	      "sensor_msgs::msg::dds_::LaserScan_"})
		EXPECT_EQ(kind_of_type(type), MessageKind::kLaserScan) << type;
	EXPECT_EQ(kind_of_type("nav_msgs::msg::dds_::Odometry_"), MessageKind::kOdometry);
	EXPECT_EQ(kind_of_type("tf2_msgs::msg::dds_::TFMessage_"), MessageKind::kTransforms);
	EXPECT_EQ(kind_of_type("sensor_msgs/MultiEchoLaserScan"), MessageKind::kMultiEchoLaserScan);
	for (const char* type : {"", "_", "::", "sensor_msgs/LaserScan_", "my_msgs/LaserScan", "/msg/"})
		EXPECT_EQ(kind_of_type(type), MessageKind::kOther) << type;
}

TEST_F(MessageSources, FolderWhoseFilesAreMissingNamesThem)
{
	write("metadata.yaml", "rosbag2_bagfile_information:\n  relative_file_paths: [gone.mcap]\n");
	try
	{
		open_messages(path(""), RosFormat::kFolder);
		FAIL() << "was opened";
	}
	catch (const LogError& e)
	{
		EXPECT_NE(std::string(e.what()).find("gone.mcap: is missing"), std::string::npos) << e.what();
	}
	write("metadata.yaml", "- 1\n");
	EXPECT_THROW(open_messages(path(""), RosFormat::kFolder), LogError);
}

TEST_F(MessageSources, DamagedBagsOfRos1DoNoHarm)
{
	expect_no_harm(bag1_file(recording(Wire::kRos1), {"", 5}), RosFormat::kBag1);
	expect_no_harm(bag1_file(recording(Wire::kRos1), {"lz4", 5}), RosFormat::kBag1);
	expect_no_harm(bag1_file(recording(Wire::kRos1), {"bz2", 5, false}), RosFormat::kBag1);
}

TEST_F(MessageSources, MessagesOfABagWhoseConnectionHasNoTypeAreDamage)
{
	std::string file = bag1_file({made_scan(Wire::kRos1, {})}, {"", 5, false});
	file[file.find("type=")] = 'T';
	const Reading reading = read_file(file, RosFormat::kBag1);
	EXPECT_TRUE(reading.times.empty());
	EXPECT_NE(reading.damage.find("type"), std::string::npos) << reading.damage;
}

TEST_F(MessageSources, DamagedMcapFilesDoNoHarm)
{
	expect_no_harm(mcap_file(recording(Wire::kCdr), {"", 0}), RosFormat::kMcap);
	expect_no_harm(mcap_file(recording(Wire::kCdr), {"zstd", 5}), RosFormat::kMcap);
	expect_no_harm(mcap_file(recording(Wire::kCdr), {"lz4", 5}), RosFormat::kMcap);
}

TEST_F(MessageSources, DamagedSqliteBagsDoNoHarm)
{
#ifndef D2S1R_SQLITE
	GTEST_SKIP() << "built without libsqlite3-dev";
#endif
	save_sqlite_bag(path("whole"), recording(Wire::kCdr));
	expect_no_harm(read("whole"), RosFormat::kSqlite);
}

TEST_F(MessageSources, AMessageThatWaitsKeepsNothingButItselfInMemory)
{
	const auto ros1 = recording(Wire::kRos1), cdr = recording(Wire::kCdr);
	write("bag", bag1_file(ros1, {"", 20}));
	write("mcap", mcap_file(cdr, {"", 20}));
	write("unchunked", mcap_file(cdr, {"", 0}));
	for (const std::string name : {"bag", "mcap", "unchunked"})
	{
		const auto source = open_messages(path(name), name == "bag" ? RosFormat::kBag1 : RosFormat::kMcap);
		while (const auto message = source->next()) EXPECT_EQ(message->owner->size(), message->data.size) << name;
	}
}

TEST_F(MessageSources, MessagesThatWouldTakeTooMuchMemoryToWaitEndTheReading)
{
	if (!can_pack("zstd")) GTEST_SKIP() << "built without libzstd-dev";
	constexpr std::size_t kSize = 16 << 20, kChunks = 20;  // 336 MB
	const MadeMessage early = made_scan(Wire::kCdr, {}), late{early.topic, early.type, kSecond, std::string(kSize, 0)};
	std::string file = mcap_file({early, late}, {"zstd", 2, false});
	constexpr std::size_t kChunkAt = 29;  // [byte] after the magic and the header
	std::uint64_t content = 0;
	std::memcpy(&content, &file[kChunkAt + 1], sizeof content);
	const std::string chunk = file.substr(kChunkAt, 9 + content);
	for (std::size_t i = 1; i < kChunks; i++) file.insert(kChunkAt, chunk);
	const std::string damage = damage_of(file, RosFormat::kMcap);
	EXPECT_EQ(damage.rfind("is damaged, or its chunks are out of order (more than 256 MB", 0), 0U) << damage;
}

TEST_F(MessageSources, MessagesThatWaitComeBeforeTheDamageIsTold)
{
	auto messages = recording(Wire::kCdr);
	std::swap(messages[2], messages[18]);  // so that the second chunk is read when messages of the first one wait
	std::string file = mcap_file(messages, {"", 10, false});
	const auto place = file.rfind("laser");
	file[place] = 'L';
	EXPECT_NE(damage_of(file, RosFormat::kMcap).find("checksum"), std::string::npos);
	EXPECT_EQ(read_file(file, RosFormat::kMcap).times.size(), 5U);
}

TEST_F(MessageSources, NamesOfTopicsThatTakeTooMuchMemoryEndTheReading)
{
	for (const Wire wire : {Wire::kRos1, Wire::kCdr})
	{
		std::vector<MadeMessage> messages;
		for (char c = 'a'; c <= 'z'; c++) messages.push_back(made_scan(wire, {}, std::string(1'000'000, c)));
		const bool is_bag = wire == Wire::kRos1;
		const std::string damage = is_bag ? damage_of(bag1_file(messages), RosFormat::kBag1)
		                                  : damage_of(mcap_file(messages, {"", 1, false}), RosFormat::kMcap);
		EXPECT_NE(damage.find("names of its topics take too much memory"), std::string::npos) << damage;
	}
}

#ifdef D2S1R_SQLITE
TEST_F(MessageSources, SqliteBagsWithAJournalAreRefusedAndLeftAsTheyAre)
{
	save_sqlite_bag(path("log"), recording(Wire::kCdr));
	write("log-wal", "");
	EXPECT_EQ(read_all(*open_messages(path("log"), RosFormat::kSqlite)).times.size(), 10U) << "it holds nothing";
	std::filesystem::create_symlink(path("log"), path("link"));
	write("log-wal", std::string(100, 'x'));
	for (const char* const name : {"log", "link"})
	{
		try
		{
			open_messages(path(name), RosFormat::kSqlite);
			ADD_FAILURE() << name << " was opened";
		}
		catch (const LogError& e)
		{
			EXPECT_NE(std::string(e.what()).find("wal_checkpoint(TRUNCATE)"), std::string::npos) << e.what();
		}
	}
	EXPECT_EQ(count(), 3) << "no file was added";
}

/// Gives a bag other messages, without an index.
std::string other_messages(int count, const std::string& data, const std::string& topic = "/scan")
{
	return "DROP TABLE messages; CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, "
	       "data BLOB); WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < " +
	       std::to_string(count) +
	       ") INSERT INTO messages(topic_id, timestamp, data) SELECT ifnull((SELECT id FROM topics WHERE name = '" +
	       topic + "'), 99), 1000000 - i, " + data + " FROM n;";
}

/// Leads all ways through a tree of SQLite that begin at `page` to the page `child`. \return the page that was first
std::uint32_t lead_to(std::string& file, std::uint32_t page, std::optional<std::uint32_t> child = {})
{
	constexpr std::size_t kPage = 4096;  // [byte]
	char* const start = &file.at(kPage * (page - 1));
	const auto number = [&](std::size_t at, std::size_t bytes)
	{
		std::uint32_t value = 0;
		for (std::size_t i = 0; i < bytes; i++) value = value << 8 | static_cast<unsigned char>(start[at + i]);
		return value;
	};
	EXPECT_EQ(number(0, 1), 5U) << "not an inner page of a table";
	const std::uint32_t first = number(number(12, 2), 4);
	const auto set = [&](std::size_t at)
	{
		for (std::size_t i = 0; i < 4; i++) start[at + i] = static_cast<char>(child.value_or(first) >> 8 * (3 - i));
	};
	for (std::uint32_t cell = 0; cell < number(3, 2); cell++) set(number(12 + 2 * cell, 2));
	set(8);
	return first;
}

std::uint32_t root_page(const std::string& path, const std::string& table)
{
	sqlite3* database = nullptr;
	sqlite3_open(path.c_str(), &database);
	std::uint32_t page = 0;
	const auto take = [](void* to, int, char** values, char**)
	{
		*static_cast<std::uint32_t*>(to) = static_cast<std::uint32_t>(std::atoi(values[0]));
		return 0;
	};
	const std::string query = "SELECT rootpage FROM sqlite_master WHERE name = '" + table + "'";
	sqlite3_exec(database, query.c_str(), take, &page, nullptr);
	sqlite3_close(database);
	return page;
}

TEST_F(MessageSources, SqliteBagsWithoutAnIndexAreSortedWithoutAFile)
{
	save_sqlite_bag(path("log"), recording(Wire::kCdr));
	alter_sqlite_bag(path("log"), other_messages(40, "zeroblob(200000)"));
	rlimit before = {};
	getrlimit(RLIMIT_FSIZE, &before);
	const rlimit none = {0, before.rlim_max};
	const auto handler = std::signal(SIGXFSZ, SIG_IGN);
	setrlimit(RLIMIT_FSIZE, &none);
	const Reading reading = read_all(*open_messages(path("log"), RosFormat::kSqlite));
	setrlimit(RLIMIT_FSIZE, &before);
	std::signal(SIGXFSZ, handler);
	EXPECT_EQ(reading.damage, "");
	ASSERT_EQ(reading.times.size(), 40U);
	EXPECT_TRUE(std::is_sorted(reading.times.begin(), reading.times.end()));
	EXPECT_EQ(reading.data.front().size(), 200'000U);
}

TEST_F(MessageSources, SqliteBagsThatTakeTooMuchMemoryAreRefused)
{
	save_sqlite_bag(path("log"), recording(Wire::kCdr));
	alter_sqlite_bag(path("log"), other_messages(100'000, "x'00'"));
	sqlite3_hard_heap_limit64(4'000'000);
	const std::string damage = read_all(*open_messages(path("log"), RosFormat::kSqlite)).damage;
	sqlite3_hard_heap_limit64(0);
	EXPECT_EQ(damage.rfind("would take more than 4 MB of memory to be read", 0), 0U) << damage;
}

/// What a file computes, and what is no table of its own, may work for hours and is not asked to stop.
TEST_F(MessageSources, SqliteBagsThatComputeTheirMessagesAreRefused)
{
	const auto why = [&](const std::string& statements)
	{
		save_sqlite_bag(path("log"), recording(Wire::kCdr));
		alter_sqlite_bag(path("log"), "ALTER TABLE messages RENAME TO old; " + statements);
		try
		{
			return read_all(*open_messages(path("log"), RosFormat::kSqlite)).damage;
		}
		catch (const LogError& e)
		{
			return std::string(e.what());
		}
	};
	const std::string start = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, ";
	EXPECT_NE(
	    why(start + "data BLOB, timestamp AS (instr(printf('%.60000000c', 'a'), 'b')))")
	        .find("'timestamp' of its table"),
	    std::string::npos);
	EXPECT_NE(
	    why(start + "timestamp INTEGER, data AS (zeroblob(60000000)) STORED)").find("'messages' is computed"),
	    std::string::npos);
	EXPECT_NE(why(start + "timestamp INTEGER)").find("'data' of its table 'messages' is missing"), std::string::npos);
	EXPECT_NE(
	    why("CREATE TABLE messages(id INTEGER, topic_id INTEGER, timestamp INTEGER, data BLOB)").find("primary key"),
	    std::string::npos);
	EXPECT_NE(why("CREATE VIEW messages AS SELECT * FROM old").find("lacks the tables"), std::string::npos);
	EXPECT_NE(
	    why("CREATE VIRTUAL TABLE messages USING fts5(id, topic_id, timestamp, data)").find("lacks the tables"),
	    std::string::npos);
}

/// `rowid` would name such a column, and each message would be looked for through the whole table.
TEST_F(MessageSources, SqliteBagsWithAColumnNamedRowidGiveTheirMessages)
{
	save_sqlite_bag(path("log"), recording(Wire::kCdr));
	alter_sqlite_bag(path("log"), "ALTER TABLE messages ADD COLUMN rowid INTEGER DEFAULT 3");
	const Reading reading = read_all(*open_messages(path("log"), RosFormat::kSqlite));
	EXPECT_EQ(reading.times, times_of(recording(Wire::kCdr)));
	EXPECT_EQ(reading.damage, "");
	EXPECT_NE(reading.data[0], reading.data[1]);
}

/// The pages of a tree may lead to one of them many times, to another tree, and so on: a few pages are any number of
/// messages.
TEST_F(MessageSources, SqliteBagsOfMoreMessagesThanTheyHaveBytesForAreDamaged)
{
	save_sqlite_bag(path("log"), recording(Wire::kCdr));
	alter_sqlite_bag(path("log"), other_messages(400, "zeroblob(3000)"));
	const std::uint32_t root = root_page(path("log"), "messages");
	std::string file = read("log");
	const std::uint32_t leaf = lead_to(file, root);
	file.resize(4096 * std::max(root, leaf));
	const auto pages = static_cast<unsigned char>(std::max(root, leaf));
	file.replace(28, 4, std::string(3, '\0') + static_cast<char>(pages));
	Reading reading = read_file(file, RosFormat::kSqlite);
	EXPECT_NE(reading.damage.find("its messages are larger than the file"), std::string::npos) << reading.damage;
	EXPECT_LT(reading.times.size(), pages * 4096U / 3000U + 1);

	save_sqlite_bag(path("log"), recording(Wire::kCdr));
	alter_sqlite_bag(path("log"), "CREATE TABLE more(id INTEGER PRIMARY KEY, topic_id, timestamp, data)");
	alter_sqlite_bag(
	    path("log"), other_messages(4000, "zeroblob(400)", "/none") + "INSERT INTO more SELECT * FROM messages;");
	const std::uint32_t first = root_page(path("log"), "messages"), second = root_page(path("log"), "more");
	file = read("log");
	const std::uint32_t last = lead_to(file, first, second);
	lead_to(file, second, last);
	const auto kept = static_cast<unsigned char>(std::max({first, second, last}));
	file.resize(4096U * kept);
	file.replace(28, 4, std::string(3, '\0') + static_cast<char>(kept));
	reading = read_file(file, RosFormat::kSqlite);
	EXPECT_NE(reading.damage.find("far more work"), std::string::npos) << reading.damage;
}
#endif
