// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// ROS 2 bags in sqlite3 files, as rosbag2_storage_sqlite3 writes them.
#include "bags/message_source.h"
#include "logs/errors.h"

#ifdef D2S1R_SQLITE
#include <sqlite3.h>

#include <cerrno>
#include <filesystem>
#include <map>
#include <new>
#endif

namespace d2s1r::logs
{
#ifdef D2S1R_SQLITE
namespace
{
struct Close
{
	void operator()(sqlite3* database) const { sqlite3_close(database); }
	void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

/// [byte] that SQLite takes, also for sorting without an index, unless the application has set another limit
constexpr std::int64_t kMostMemory = 512'000'000;
constexpr int kInstructions = 100;  // of SQLite's machine between two questions: ten tables, or two messages
constexpr int kMostColumns = 100;   // [-] of a table: those of bags have five

/// The file of a database as a URI. SQLite takes it for one that nobody writes to: then it neither locks the file nor
/// writes anything beside it.
std::string uri_of(const std::string& path)
{
	std::string uri = "file:";
	for (const char c : path)
	{
		constexpr const char* kDigits = "0123456789abcdef";
		const auto byte = static_cast<unsigned char>(c);
		if (std::isalnum(byte) || c == '/' || c == '.' || c == '_' || c == '-')
			uri += c;
		else
			uri += {'%', kDigits[byte / 16], kDigits[byte % 16]};
	}
	return uri + "?immutable=1";
}

/// Refuses a file whose last messages are in a journal beside it: SQLite cannot read that without writing beside it.
void check_has_no_journal(const std::string& path)
{
	namespace fs = std::filesystem;
	std::error_code error;
	const fs::path real = fs::canonical(path, error);  // the journal stands there
	const std::string file = error ? path : real.string();
	const bool has_journal = fs::exists(file + "-wal", error) && fs::file_size(file + "-wal", error) > 0;
	if (has_journal)
		throw LogError(
		    path,
		    "has messages in a journal beside it (-wal), which cannot be read without writing; end the recording, "
		    "or move them into the file by: sqlite3 FILE 'PRAGMA wal_checkpoint(TRUNCATE)'");
}

/// Holds a column of a table as the file has it.
struct Column
{
	bool is_stored = false;  //!< and not computed
	int place_in_key = 0;    //!< [-] from 1; 0 if it is not part of the primary key
};

class SqliteSource : public MessageSource
{
   public:
	SqliteSource(const std::string& path, Stop stop, bool with_clouds)
	    : stop_(std::move(stop)), with_clouds_(with_clouds)
	{
		check_has_no_journal(path);
		std::error_code error;
		file_size_ = std::filesystem::file_size(path, error);
		if (sqlite3_hard_heap_limit64(-1) == 0) sqlite3_hard_heap_limit64(kMostMemory);  // of the whole process
		sqlite3* opened = nullptr;
		errno = 0;
		const int result =
		    sqlite3_open_v2(uri_of(path).c_str(), &opened, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
		database_.reset(opened);
		try
		{
			if (result != SQLITE_OK) fail();
			believe_nothing();
			ask_to_stop_while_it_works();
			read_schema();
			step(prepare("PRAGMA temp_store = MEMORY"));  // what is sorted without an index goes to no file
			read_topics();
			messages_ = prepare(
			    "SELECT topic_id, timestamp, id FROM messages WHERE topic_id IN (" + chosen_topics() +
			    ") ORDER BY timestamp, id");
			data_ = prepare("SELECT data FROM messages WHERE id = ?");  // apart, so that no data is sorted
		}
		catch (const std::exception& e)
		{
			throw LogError(path, describe_damage(e));
		}
	}

	std::optional<Message> next() override
	try
	{
		if (stop_()) throw Interrupted();
		if (ended_ || !step(messages_))
		{
			ended_ = true;  // another step would start from the first message again
			return std::nullopt;
		}
		const auto topic = topics_.find(sqlite3_column_int64(messages_.get(), 0));
		if (topic == topics_.end()) return next();
		Message message{topic->second, sqlite3_column_int64(messages_.get(), 1), {}, {}};
		sqlite3_reset(data_.get());
		sqlite3_bind_int64(data_.get(), 1, sqlite3_column_int64(messages_.get(), 2));
		if (!step(data_)) throw std::runtime_error("a message has no data");
		const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(data_.get(), 0));
		const auto size = static_cast<std::size_t>(sqlite3_column_bytes(data_.get(), 0));
		if (!data && sqlite3_errcode(database_.get()) == SQLITE_NOMEM) fail();
		data_bytes_ += size;
		if (data_bytes_ > file_size_) throw std::runtime_error("its messages are larger than the file");
		message.owner = std::make_shared<const std::vector<std::uint8_t>>(data, data + (data ? size : 0));
		message.data = {message.owner->data(), message.owner->size()};
		unpack_message(message, file_size_);
		return message;
	}
	catch (const std::exception& e)
	{
		damage_ = describe_damage(e);
		ended_ = true;
		return std::nullopt;
	}

   private:
	using Statement = std::unique_ptr<sqlite3_stmt, Close>;

	/// Says why the call before has failed; errno was 0 before that.
	[[noreturn]] void fail() const
	{
		const int error = errno;
		const int code = database_ ? sqlite3_extended_errcode(database_.get()) : SQLITE_NOMEM;
		constexpr int kKind = 0xff;  // what a code of the more exact ones is a case of
		const bool is_out_of_memory = (code & kKind) == SQLITE_NOMEM || code == SQLITE_IOERR_NOMEM;
		if ((code & kKind) == SQLITE_INTERRUPT && instructions_ > most_instructions_)
			throw std::runtime_error("it takes far more work than so many bytes can need");
		if ((code & kKind) == SQLITE_INTERRUPT) throw Interrupted();
		const std::int64_t most = sqlite3_hard_heap_limit64(-1);
		if (is_out_of_memory && sqlite3_memory_highwater(0) > most / 2)
			throw Unreadable(
			    "would take more than " + std::to_string(most / 1'000'000) +
			    " MB of memory to be read: it is damaged, or has no index of the times (timestamp_idx); record it "
			    "again, or add the index");
		if (is_out_of_memory) throw std::bad_alloc();
		const bool is_called_damage = (code & kKind) == SQLITE_CORRUPT && (error == EIO || error == ENXIO);
		const bool is_read_error = (code & kKind) == SQLITE_IOERR && code != SQLITE_IOERR_SHORT_READ;
		if (is_called_damage || is_read_error) throw_unread(std::strerror(error));
		throw std::runtime_error(sqlite3_errmsg(database_.get()));
	}

	/// Allows SQLite nothing but to read the tables of a bag. A file may bring expressions of its own, as columns that
	/// are computed, views or virtual tables, each of which may work for hours between two questions whether to stop.
	void believe_nothing()
	{
		sqlite3* const database = database_.get();
		sqlite3_limit(database, SQLITE_LIMIT_LENGTH, static_cast<int>(kMostBytesAtOnce));
		sqlite3_limit(database, SQLITE_LIMIT_COLUMN, kMostColumns);
		sqlite3_db_config(database, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
		sqlite3_db_config(database, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
		sqlite3_db_config(database, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
		sqlite3_db_config(database, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
		const auto authorize = [](void*, int action, const char*, const char* what, const char*, const char*)
		{
			const bool is_count = action == SQLITE_FUNCTION && std::string(what) == "count";
			const bool is_read = action == SQLITE_SELECT || action == SQLITE_READ || action == SQLITE_PRAGMA;
			return is_read || is_count ? SQLITE_OK : SQLITE_DENY;
		};
		sqlite3_set_authorizer(database, authorize, nullptr);
	}

	/// Reads how the tables of the file are made. A bag says that in some hundred bytes for each of them; some work
	/// grows with the square of these, counts for no instruction, and cannot be stopped.
	void read_schema()
	{
		constexpr int kMostOfFile = 2000, kMostOfOurs = 1'000'000;    // [byte] of a statement
		constexpr std::uint64_t kMostOfSchema = 20'000;               // some thousand tables and indexes
		constexpr std::uint64_t kAnyFile = 1'000'000, kOfAByte = 20;  // a message takes some 40, and a dozen bytes
		most_instructions_ = kMostOfSchema;
		sqlite3_limit(database_.get(), SQLITE_LIMIT_SQL_LENGTH, kMostOfFile);
		step(prepare("SELECT count(*) FROM sqlite_master"));
		sqlite3_limit(database_.get(), SQLITE_LIMIT_SQL_LENGTH, kMostOfOurs);
		most_instructions_ = kAnyFile + kOfAByte * file_size_;
	}

	void ask_to_stop_while_it_works()
	{
		const auto ask = [](void* self)
		{
			auto& source = *static_cast<SqliteSource*>(self);
			source.instructions_ += kInstructions;
			return source.stop_() || source.instructions_ > source.most_instructions_ ? 1 : 0;
		};
		sqlite3_progress_handler(database_.get(), kInstructions, ask, this);
	}

	Statement prepare(const std::string& query) const
	{
		sqlite3_stmt* statement = nullptr;
		errno = 0;
		if (sqlite3_prepare_v2(database_.get(), query.c_str(), -1, &statement, nullptr) != SQLITE_OK) fail();
		return Statement(statement);
	}

	bool step(const Statement& statement) const
	{
		errno = 0;
		const int result = sqlite3_step(statement.get());
		if (result != SQLITE_ROW && result != SQLITE_DONE) fail();
		return result == SQLITE_ROW;
	}

	static std::string text_in(const Statement& statement, int column)
	{
		const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement.get(), column));
		return text ? text : "";
	}

	std::map<std::string, Column> columns_of(const std::string& table) const
	{
		std::map<std::string, Column> columns;
		const Statement row = prepare("PRAGMA table_xinfo(" + table + ")");
		while (step(row))  // number, name, type, not null, default, place in the primary key, hidden
			columns[text_in(row, 1)] = {sqlite3_column_int(row.get(), 6) == 0, sqlite3_column_int(row.get(), 5)};
		return columns;
	}

	/// Checks that a table has the columns of a ROS 2 bag, that the file holds all of them, and that SQLite finds a row
	/// by its `id` at once.
	void check_table(const std::string& table, const std::vector<std::string>& expected) const
	{
		const auto columns = columns_of(table);
		const auto refuse = [&](const std::string& column, const char* why)
		{
			throw Unreadable(
			    "is a sqlite3 file, but no ROS 2 bag: column '" + column + "' of its table '" + table + "' " + why);
		};
		for (const std::string& name : expected)
		{
			const auto column = columns.find(name);
			if (column == columns.end()) refuse(name, "is missing");
			if (!column->second.is_stored) refuse(name, "is computed");
		}
		for (const auto& [name, column] : columns)
			if ((column.place_in_key > 0) != (name == "id")) refuse("id", "is not its primary key");
	}

	void read_topics()
	{
		const Statement tables = prepare(
		    "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND rootpage > 0 AND name IN ('topics', "
		    "'messages')");
		if (!step(tables) || sqlite3_column_int(tables.get(), 0) != 2)
			throw Unreadable("is a sqlite3 file, but no ROS 2 bag: it lacks the tables 'topics' and 'messages'");
		check_table("topics", {"id", "name", "type", "serialization_format"});
		check_table("messages", {"id", "topic_id", "timestamp", "data"});
		const Statement topics = prepare("SELECT id, name, type FROM topics WHERE serialization_format = 'cdr'");
		while (step(topics))
		{
			const MessageKind kind = kind_of_type(text_in(topics, 2), with_clouds_);
			if (kind == MessageKind::kOther)
				note_unread(text_in(topics, 1), text_in(topics, 2));
			else
				topics_.emplace(
				    sqlite3_column_int64(topics.get(), 0), keep({text_in(topics, 1), kind, Encoding::kCdr}));
		}
	}

	std::string chosen_topics() const
	{
		std::string numbers;
		for (const auto& topic : topics_) numbers += (numbers.empty() ? "" : ",") + std::to_string(topic.first);
		return numbers;
	}

	Stop stop_;
	bool with_clouds_;
	std::unique_ptr<sqlite3, Close> database_;
	std::map<std::int64_t, std::shared_ptr<const Topic>> topics_;
	Statement messages_;  //!< their topics, times and numbers, in order
	Statement data_;      //!< of the message with a number
	bool ended_ = false;
	std::uint64_t file_size_ = 0;          //!< [byte]
	std::uint64_t data_bytes_ = 0;         //!< [byte] of the messages so far
	std::uint64_t instructions_ = 0;       //!< [-] of SQLite's machine so far
	std::uint64_t most_instructions_ = 0;  //!< [-] that the file can need
};
}  // namespace

std::unique_ptr<MessageSource> open_sqlite(const std::string& path, const Stop& stop, bool with_clouds)
{
	return std::make_unique<SqliteSource>(path, stop, with_clouds);
}
#else
std::unique_ptr<MessageSource> open_sqlite(const std::string& path, const Stop& /*stop*/, bool /*with_clouds*/)
{
	throw LogError(
	    path, "is a sqlite3 file, which this program was built without; install libsqlite3-dev and build it again");
}
#endif
}  // namespace d2s1r::logs
