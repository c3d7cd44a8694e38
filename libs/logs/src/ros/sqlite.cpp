// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// ROS 2 bags in sqlite3 files, as rosbag2_storage_sqlite3 writes them.
#include "logs/errors.h"
#include "ros/message_source.h"

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

/// The file of a database as a URI. Without a journal beside it, nobody writes the file: then no lock is needed, which
/// could not be had in a folder without permission to write.
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
	return std::filesystem::exists(path + "-wal") ? uri : uri + "?immutable=1";
}

class SqliteSource : public MessageSource
{
   public:
	explicit SqliteSource(const std::string& path)
	{
		sqlite3* opened = nullptr;
		errno = 0;
		const int result =
		    sqlite3_open_v2(uri_of(path).c_str(), &opened, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
		database_.reset(opened);
		try
		{
			if (result != SQLITE_OK) fail();
			sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, static_cast<int>(kMostBytesAtOnce));
			read_topics();
			messages_ = prepare(
			    "SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN (" + chosen_topics() +
			    ") ORDER BY timestamp, id");
		}
		catch (const std::exception& e)
		{
			throw LogError(path, describe_damage(e));
		}
	}

	std::optional<Message> next() override
	try
	{
		if (ended_ || !step(messages_))
		{
			ended_ = true;  // another step would start from the first message again
			return std::nullopt;
		}
		const auto topic = topics_.find(sqlite3_column_int64(messages_.get(), 0));
		if (topic == topics_.end()) return next();
		Message message{topic->second, sqlite3_column_int64(messages_.get(), 1), {}, {}};
		const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(messages_.get(), 2));
		const auto size = static_cast<std::size_t>(sqlite3_column_bytes(messages_.get(), 2));
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
		if ((code & kKind) == SQLITE_NOMEM || code == SQLITE_IOERR_NOMEM) throw std::bad_alloc();
		const bool is_called_damage = (code & kKind) == SQLITE_CORRUPT && (error == EIO || error == ENXIO);
		const bool is_read_error = (code & kKind) == SQLITE_IOERR && code != SQLITE_IOERR_SHORT_READ;
		if (is_called_damage || is_read_error) throw_unread(std::strerror(error));
		throw std::runtime_error(sqlite3_errmsg(database_.get()));
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
			const Topic topic{text_in(topics, 1), kind_of_type(text_in(topics, 2)), Encoding::kCdr};
			if (topic.kind != MessageKind::kOther)
				topics_.emplace(sqlite3_column_int64(topics.get(), 0), std::make_shared<const Topic>(topic));
		}
	}

	/// Numbers of the topics that are read, separated by commas.
	std::string chosen_topics() const
	{
		std::string numbers;
		for (const auto& topic : topics_) numbers += (numbers.empty() ? "" : ",") + std::to_string(topic.first);
		return numbers;
	}

	std::unique_ptr<sqlite3, Close> database_;
	std::map<std::int64_t, std::shared_ptr<const Topic>> topics_;
	Statement messages_;
	bool ended_ = false;
};
}  // namespace

std::unique_ptr<MessageSource> open_sqlite(const std::string& path)
{
	return std::make_unique<SqliteSource>(path);
}
#else
std::unique_ptr<MessageSource> open_sqlite(const std::string& path)
{
	throw LogError(
	    path, "is a sqlite3 file, which this program was built without; install libsqlite3-dev and build it again");
}
#endif
}  // namespace d2s1r::logs
