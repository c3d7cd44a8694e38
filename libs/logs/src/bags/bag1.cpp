// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// ROS 1 bags, as http://wiki.ros.org/Bags/Format/2.0 has them. Debian's librosbag-storage is not used: it follows the
// offsets of a file unchecked, so that damaged bags end it by a signal, and it holds the index of all messages.
#include <algorithm>
#include <limits>
#include <map>

#include "bags/message_source.h"
#include "logs/errors.h"

namespace d2s1r::logs
{
namespace
{
constexpr std::uint64_t kMagicSize = 13;  // [byte] "#ROSBAG V2.0\n"

enum Operation : std::uint8_t
{
	kMessage = 2,
	kBagHeader = 3,
	kIndex = 4,
	kChunk = 5,
	kConnection = 7
};

/// The value of a field in the header of a record, which is a row of "name=value"; no value if there is none.
std::optional<Bytes> find_field(Bytes header, const char* name)
{
	ByteCursor cursor(header);
	while (cursor.left() > 0)
	{
		const Bytes field = cursor.take(cursor.number<std::uint32_t>());
		const std::size_t length = std::strlen(name);
		if (field.size > length && field.data[length] == '=' && std::memcmp(field.data, name, length) == 0)
			return Bytes{field.data + length + 1, field.size - length - 1};
	}
	return std::nullopt;
}

Bytes field_of(Bytes header, const char* name)
{
	const auto field = find_field(header, name);
	if (!field) throw std::runtime_error("a record lacks the field '" + std::string(name) + "'");
	return *field;
}

template <typename Number>
Number number_of(Bytes header, const char* name)
{
	return ByteCursor(field_of(header, name)).number<Number>();
}

std::string text_of(Bytes field)
{
	return {reinterpret_cast<const char*>(field.data), field.size};
}

std::int64_t nanoseconds(ByteCursor& cursor)
{
	const auto seconds = cursor.number<std::uint32_t>();
	return std::int64_t{seconds} * 1'000'000'000 + cursor.number<std::uint32_t>();
}

/// A bag is a row of records; those with messages are in chunks, each of which is a piece.
class Bag1Source : public PieceSource
{
   public:
	Bag1Source(const std::string& path, const Stop& stop, bool with_clouds)
	    : PieceSource(stop), file_(path), with_clouds_(with_clouds)
	{
		check_magic(path);
		std::vector<Piece> pieces;
		std::string damage;
		try
		{
			find_pieces(pieces);
			for (Piece& piece : pieces)
				if (piece.first_time == kNoTime) piece.first_time = first_time_of(piece);
		}
		catch (const std::exception& e)
		{
			damage = describe_damage(e);
		}
		set_pieces(std::move(pieces), std::move(damage), file_.size());
	}

   private:
	static constexpr std::int64_t kNoTime = std::numeric_limits<std::int64_t>::max();

	/// A record of the file; its data stay there.
	struct Record
	{
		std::vector<std::uint8_t> header;
		std::uint8_t operation = 0;
		std::uint64_t data = 0;  //!< [byte] offset in the file
		std::uint32_t size = 0;  //!< [byte] of the data

		Bytes fields() const { return {header.data(), header.size()}; }
		std::uint64_t end() const { return data + size; }
	};

	static void check_magic(const std::string& path)
	{
		const std::string magic = first_bytes(path);
		if (magic.rfind("#ROSBAG V2.0\n", 0) == 0) return;
		throw LogError(
		    path, "is a ROS bag of version " + magic.substr(magic.find(" V") + 1, 4) +
		              ", but only V2.0 is read, which ROS writes since 2010; convert it with the tools of its ROS");
	}

	Record read_record(std::uint64_t offset)
	{
		const auto size_at = [this](std::uint64_t at) { return ByteCursor(file_.view(at, 4)).number<std::uint32_t>(); };
		const std::uint32_t header_size = size_at(offset);
		const Bytes header = file_.view(offset + 4, header_size);
		Record record;
		record.header.assign(header.data, header.data + header.size);
		record.operation = number_of<std::uint8_t>(header, "op");
		record.data = offset + 4 + header_size + 4;
		record.size = size_at(record.data - 4);
		if (record.operation == kIndex)  // early recorders gave it too large a size
			record.size = std::min(record.size, size_of_index(record.fields()));
		if (record.end() > file_.size()) throw std::runtime_error("it ends within a record");
		return record;
	}

	/// [byte] of the entries that it says it has, at most what a record can have.
	static std::uint32_t size_of_index(Bytes fields)
	{
		constexpr std::uint32_t kEntrySize = 12;  // a time and an offset
		constexpr std::uint32_t kMostEntries = std::numeric_limits<std::uint32_t>::max() / kEntrySize;
		return kEntrySize * std::min(number_of<std::uint32_t>(fields, "count"), kMostEntries);
	}

	void find_pieces(std::vector<Piece>& pieces)
	{
		std::uint64_t end = kMagicSize;
		while (end < file_.size())
		{
			ask_to_stop();
			const std::uint64_t start = end;
			const Record record = read_record(start);
			end = record.end();
			const auto encryptor = find_field(record.fields(), "encryptor");
			if (record.operation == kBagHeader && encryptor && encryptor->size > 0)
				throw Unreadable("is encrypted; decrypt it by 'rosbag decrypt' first");
			if (record.operation == kMessage) throw std::runtime_error("a message is outside of all chunks");
			if (record.operation == kConnection) add_topic(record.fields(), file_.view(record.data, record.size));
			if (record.operation == kChunk) pieces.push_back({start, end - start, kNoTime});
			if (record.operation == kIndex && !pieces.empty())
				add_index(file_.view(record.data, record.size), pieces.back());
		}
	}

	/// The times of one connection's messages in the chunk before.
	static void add_index(Bytes entries, Piece& piece)
	{
		ByteCursor cursor(entries);
		while (cursor.left() > 0)
		{
			piece.first_time = std::min(piece.first_time, nanoseconds(cursor));
			cursor.take(sizeof(std::uint32_t));
		}
	}

	std::int64_t first_time_of(const Piece& piece)
	{
		ask_to_stop();
		std::int64_t first = kNoTime;
		load(piece, [&](const auto& /*topic*/, std::int64_t time, Bytes /*data*/) { first = std::min(first, time); });
		return first;
	}

	void add_topic(Bytes fields, Bytes data)
	{
		const auto connection = number_of<std::uint32_t>(fields, "conn");
		if (topics_.count(connection) != 0) return;
		const std::string type = text_of(field_of(data, "type"));
		const MessageKind kind = kind_of_type(type, with_clouds_);
		if (kind == MessageKind::kOther) note_unread(text_of(field_of(fields, "topic")), type);
		topics_[connection] = keep({text_of(field_of(fields, "topic")), kind, Encoding::kRos1});
	}

	void load(const Piece& piece, const Add& add) override
	{
		const Record chunk = read_record(piece.offset);
		const std::string method = text_of(field_of(chunk.fields(), "compression"));
		const auto size = number_of<std::uint32_t>(chunk.fields(), "size");
		const std::vector<std::uint8_t> unpacked =
		    unpack(method, file_.view(chunk.data, chunk.size), size, [this] { ask_to_stop(); });
		ByteCursor cursor(Bytes{unpacked.data(), unpacked.size()});
		while (cursor.left() > 0)
		{
			const Bytes fields = cursor.take(cursor.number<std::uint32_t>());
			const Bytes data = cursor.take(cursor.number<std::uint32_t>());
			const auto operation = number_of<std::uint8_t>(fields, "op");
			if (operation == kConnection) add_topic(fields, data);
			if (operation != kMessage) continue;
			const auto topic = topics_.find(number_of<std::uint32_t>(fields, "conn"));
			if (topic == topics_.end()) throw std::runtime_error("a message is of a connection that is not defined");
			if (topic->second->kind == MessageKind::kOther) continue;
			ByteCursor time(field_of(fields, "time"));
			add(topic->second, nanoseconds(time), data);
		}
	}

	ByteFile file_;
	bool with_clouds_;
	std::map<std::uint32_t, std::shared_ptr<const Topic>> topics_;
};
}  // namespace

std::unique_ptr<MessageSource> open_bag1(const std::string& path, const Stop& stop, bool with_clouds)
{
	return std::make_unique<Bag1Source>(path, stop, with_clouds);
}
}  // namespace d2s1r::logs
