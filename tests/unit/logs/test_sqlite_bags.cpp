// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Bags of sqlite3 are databases: with journals, schemas that lie, and tables that take too much memory.
#ifdef D2S1R_SQLITE
#include <sqlite3.h>
#include <sys/resource.h>

#include <csignal>
#include <optional>

#include "logs/message_sources.h"

using namespace d2s1r::test;
using namespace d2s1r::logs;
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

/// SQLite compares each constraint of a table with all others, and is not asked to stop meanwhile.
TEST_F(MessageSources, SqliteBagsWhoseTablesTakeLongToBeUnderstoodAreRefused)
{
	save_sqlite_bag(path("log"), recording(Wire::kCdr));
	std::string table = "CREATE TABLE other(c0";
	for (int i = 1; i < 60; i++) table += ", c" + std::to_string(i);
	for (int i = 0; i < 3000; i++)
		table += ", UNIQUE(c" + std::to_string(i % 60) + ", c" + std::to_string(i / 60) + ")";
	alter_sqlite_bag(path("log"), table + ");");
	EXPECT_THROW(open_messages(path("log"), RosFormat::kSqlite), LogError);
	std::string tables = "BEGIN;";
	for (int i = 0; i < 4000; i++) tables += "CREATE TABLE t" + std::to_string(i) + "(c);";
	save_sqlite_bag(path("log"), recording(Wire::kCdr));
	alter_sqlite_bag(path("log"), tables + "COMMIT;");
	EXPECT_THROW(open_messages(path("log"), RosFormat::kSqlite), LogError);
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
