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

constexpr std::int64_t kMostMemory = 512'000'000;  // [byte] that SQLite takes, also for sorting without an index

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

class SqliteSource : public MessageSource
{
   public:
	SqliteSource(const std::string& path, Stop stop) : stop_(std::move(stop))
	{
		check_has_no_journal(path);
		sqlite3_hard_heap_limit64(kMostMemory);  // of the process, in which nothing else uses SQLite
		sqlite3* opened = nullptr;
		errno = 0;
		const int result =
		    sqlite3_open_v2(uri_of(path).c_str(), &opened, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
		database_.reset(opened);
		try
		{
			if (result != SQLITE_OK) fail();
			sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, static_cast<int>(kMostBytesAtOnce));
			ask_to_stop_while_it_works();
			step(prepare("PRAGMA temp_store = MEMORY"));  // what is sorted without an index goes to no file
			read_topics();
			messages_ = prepare(
			    "SELECT topic_id, timestamp, rowid FROM messages WHERE topic_id IN (" + chosen_topics() +
			    ") ORDER BY timestamp, id");
			data_ = prepare("SELECT data FROM messages WHERE rowid = ?");  // apart, so that no data is sorted
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
		message.owner = std::make_shared<const std::vector<std::uint8_t>>(data, data + (data ? size : 0));
		message.data = {message.owner->data(), message.owner->size()};
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
		if ((code & kKind) == SQLITE_INTERRUPT) throw Interrupted();
		if (is_out_of_memory && sqlite3_memory_highwater(0) > kMostMemory / 2)
			throw Unreadable(
			    "would take more than " + std::to_string(kMostMemory / 1'000'000) +
			    " MB of memory to be read: it is damaged, or has no index of the times (timestamp_idx); record it "
			    "again, or add the index");
		if (is_out_of_memory) throw std::bad_alloc();
		const bool is_called_damage = (code & kKind) == SQLITE_CORRUPT && (error == EIO || error == ENXIO);
		const bool is_read_error = (code & kKind) == SQLITE_IOERR && code != SQLITE_IOERR_SHORT_READ;
		if (is_called_damage || is_read_error) throw_unread(std::strerror(error));
		throw std::runtime_error(sqlite3_errmsg(database_.get()));
	}

	void ask_to_stop_while_it_works()
	{
		constexpr int kInstructions = 10000;  // of SQLite's machine between two questions: less than a millisecond
		const auto ask = [](void* stop) { return (*static_cast<const Stop*>(stop))() ? 1 : 0; };
		sqlite3_progress_handler(database_.get(), kInstructions, ask, &stop_);
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

	void read_topics()
	{
		const Statement tables =
		    prepare("SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('topics', 'messages')");
		if (!step(tables) || sqlite3_column_int(tables.get(), 0) != 2)
			throw Unreadable("is a sqlite3 file, but no ROS 2 bag: it lacks the tables 'topics' and 'messages'");
		const Statement topics = prepare("SELECT id, name, type FROM topics WHERE serialization_format = 'cdr'");
		while (step(topics))
		{
			const MessageKind kind = kind_of_type(text_in(topics, 2));
			if (kind != MessageKind::kOther)
				topics_.emplace(
				    sqlite3_column_int64(topics.get(), 0), keep({text_in(topics, 1), kind, Encoding::kCdr}));
		}
	}

	/// Numbers of the topics that are read, separated by commas.
	std::string chosen_topics() const
	{
		std::string numbers;
		for (const auto& topic : topics_) numbers += (numbers.empty() ? "" : ",") + std::to_string(topic.first);
		return numbers;
	}

	Stop stop_;
	std::unique_ptr<sqlite3, Close> database_;
	std::map<std::int64_t, std::shared_ptr<const Topic>> topics_;
	Statement messages_;  //!< their topics, times and numbers, in order
	Statement data_;      //!< of the message with a number
	bool ended_ = false;
};
}  // namespace

std::unique_ptr<MessageSource> open_sqlite(const std::string& path, const Stop& stop)
{
	return std::make_unique<SqliteSource>(path, stop);
}
#else
std::unique_ptr<MessageSource> open_sqlite(const std::string& path, const Stop& /*stop*/)
{
	throw LogError(
	    path, "is a sqlite3 file, which this program was built without; install libsqlite3-dev and build it again");
}
#endif
}  // namespace d2s1r::logs
