// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Bags of ROS 1 and ROS 2 and MCAP files: whatever the packing, the same messages in order; damage is told.
#include "logs/message_sources.h"

using namespace d2s1r::test;
using namespace d2s1r::logs;

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

TEST_F(MessageSources, AnInterruptIsHeardBetweenMessagesThatWait)
{
	write("log", bag1_file(recording(Wire::kRos1), {"", 20}));
	bool stopped = false;
	const auto source = open_messages(path("log"), RosFormat::kBag1, [&] { return stopped; });
	EXPECT_TRUE(source->next());
	stopped = true;
	EXPECT_THROW(source->next(), Interrupted);
}

TEST_F(MessageSources, AnInterruptIsHeardWhileFilesOfAFolderAreLookedUp)
{
	std::string names = "rosbag2_bagfile_information:\n  relative_file_paths:\n";
	for (int i = 0; i < 1000; i++)
	{
		const std::string name = "a_" + std::to_string(i) + ".mcap";
		names += "    - " + name + "\n";
		write(name, "");
	}
	write("metadata.yaml", names);
	int questions = 0;
	EXPECT_THROW(files_of_folder(path(""), [&] { return ++questions > 2500; }), Interrupted)
	    << "one for each name that is read, and then two for each file";
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
