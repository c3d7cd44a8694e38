// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "bags/mcap.h"

#include <zlib.h>

#include <algorithm>
#include <limits>
#include <map>

#include "bags/message_source.h"
#include "logs/errors.h"

namespace d2s1r::logs
{
namespace
{
constexpr std::uint64_t kChunkHeadSize = 28;    // [byte] from the times to the checksum
constexpr std::uint64_t kMessageHeadSize = 22;  // [byte]
constexpr std::uint64_t kRunSize = 1 << 20;     // [byte] of messages outside of chunks that are one piece
constexpr char kMagic[kMcapMagicSize + 1] = "\x89MCAP0\r\n";

std::int64_t nanoseconds(std::uint64_t time)
{
	return static_cast<std::int64_t>(std::min<std::uint64_t>(time, std::numeric_limits<std::int64_t>::max()));
}

/// A piece is a chunk, or some consecutive records outside of chunks.
class McapSource : public PieceSource
{
   public:
	McapSource(const std::string& path, const Stop& stop, bool with_clouds)
	    : PieceSource(stop), file_(path), with_clouds_(with_clouds)
	{
		if (first_bytes(path).rfind(kMagic, 0) != 0)
			throw LogError(path, "is an MCAP file of another version than 0; write it anew as version 0");
		std::vector<Piece> pieces;
		std::string damage;
		try
		{
			find_pieces(pieces);
		}
		catch (const std::exception& e)
		{
			damage = describe_damage(e);
		}
		set_pieces(std::move(pieces), std::move(damage), file_.size());
	}

   private:
	/// Follows the records one by one: an index in the file may be missing, or wrong.
	void find_pieces(std::vector<Piece>& pieces)
	{
		bool is_run = false;  // whether the last piece is one of messages outside of chunks
		McapPlace record;
		for (std::uint64_t start = kMcapMagicSize; record.opcode != McapOpcode::kFooter; start = record.end())
		{
			ask_to_stop();
			record = find_mcap_record(file_, start);
			if (record.opcode == McapOpcode::kMessage)
			{
				ByteCursor message(file_.view(record.content, std::min(record.size, kMessageHeadSize)));
				message.take(6);
				const std::int64_t time = nanoseconds(message.number<std::uint64_t>());
				if (!is_run || pieces.back().size > kRunSize) pieces.push_back({start, 0, time});
				pieces.back().first_time = std::min(pieces.back().first_time, time);
				pieces.back().size = record.end() - pieces.back().offset;
				is_run = true;
			}
			else if (record.opcode == McapOpcode::kChunk)
			{
				ByteCursor chunk(file_.view(record.content, std::min(record.size, kChunkHeadSize)));
				pieces.push_back({start, record.end() - start, nanoseconds(chunk.number<std::uint64_t>())});
				is_run = false;
			}
			else if (record.opcode == McapOpcode::kSchema || record.opcode == McapOpcode::kChannel)
				add(record.opcode, file_.view(record.content, record.size));
		}
	}

	void add(McapOpcode opcode, Bytes content)
	{
		ByteCursor cursor(content);
		const auto id = cursor.number<std::uint16_t>();
		if (opcode == McapOpcode::kSchema)
		{
			schemas_.emplace(id, cursor.text().substr(0, kLongestType + 1));  // more letters would change nothing
			return;
		}
		if (channels_.count(id) > 0) return;
		const auto schema = schemas_.find(cursor.number<std::uint16_t>());
		const std::string type = schema == schemas_.end() ? "" : schema->second;
		Topic topic{cursor.text(), kind_of_type(type, with_clouds_)};
		const std::string encoding = cursor.text();
		if (encoding == "ros1") topic.encoding = Encoding::kRos1;
		if (encoding != "ros1" && encoding != "cdr") topic.kind = MessageKind::kOther;
		if (topic.kind == MessageKind::kOther)
			note_unread(topic.name, type + (encoding == "cdr" || encoding == "ros1" ? "" : " in " + encoding));
		channels_.emplace(id, keep(std::move(topic)));
	}

	void load(const Piece& piece, const Add& add_message) override
	{
		const McapPlace first = find_mcap_record(file_, piece.offset);
		std::vector<std::uint8_t> unpacked;
		Bytes records;
		if (first.opcode == McapOpcode::kChunk)
		{
			unpacked = unpack_mcap_chunk(file_.view(first.content, first.size), [this] { ask_to_stop(); }).records;
			records = {unpacked.data(), unpacked.size()};
		}
		else
			records = file_.view(piece.offset, piece.size);
		ByteCursor cursor(records);
		while (cursor.left() > 0)
		{
			const auto [opcode, content] = take_mcap_record(cursor);
			if (opcode == McapOpcode::kSchema || opcode == McapOpcode::kChannel) add(opcode, content);
			if (opcode != McapOpcode::kMessage) continue;
			ByteCursor message(content);
			const auto channel = channels_.find(message.number<std::uint16_t>());
			if (channel == channels_.end()) throw std::runtime_error("a message is of a channel that is not defined");
			if (channel->second->kind == MessageKind::kOther) continue;
			message.take(4);  // its number in the sequence
			const std::int64_t time = nanoseconds(message.number<std::uint64_t>());
			message.take(8);  // when it was published
			add_message(channel->second, time, message.take(message.left()));
		}
	}

	ByteFile file_;
	bool with_clouds_;
	std::map<std::uint16_t, std::string> schemas_;  //!< names of types
	std::map<std::uint16_t, std::shared_ptr<const Topic>> channels_;
};
}  // namespace

McapPlace find_mcap_record(ByteFile& file, std::uint64_t offset)
{
	constexpr std::uint64_t kHeadSize = 9;  // [byte] opcode and size
	ByteCursor cursor(file.view(offset, kHeadSize));
	McapPlace record;
	record.opcode = static_cast<McapOpcode>(cursor.number<std::uint8_t>());
	record.size = cursor.number<std::uint64_t>();
	record.content = offset + kHeadSize;
	if (record.size > file.size() - record.content) throw std::runtime_error("it ends within a record");
	return record;
}

McapRecord take_mcap_record(ByteCursor& cursor)
{
	const auto opcode = static_cast<McapOpcode>(cursor.number<std::uint8_t>());
	return {opcode, cursor.take(cursor.number<std::uint64_t>())};
}

McapChunk unpack_mcap_chunk(Bytes content, const std::function<void()>& ask_to_stop)
{
	ByteCursor cursor(content);
	McapChunk chunk;
	chunk.first_time = cursor.number<std::uint64_t>();
	cursor.take(8);  // the time of the last message
	const auto size = cursor.number<std::uint64_t>();
	const auto checksum = cursor.number<std::uint32_t>();
	const std::string method = cursor.text();
	chunk.records = unpack(method, cursor.take(cursor.number<std::uint64_t>()), size, ask_to_stop);
	if (checksum != 0 && crc32_z(0, chunk.records.data(), chunk.records.size()) != checksum)
		throw std::runtime_error("a chunk has another checksum than it says");
	return chunk;
}

std::unique_ptr<MessageSource> open_mcap(const std::string& path, const Stop& stop, bool with_clouds)
{
	return std::make_unique<McapSource>(path, stop, with_clouds);
}
}  // namespace d2s1r::logs
