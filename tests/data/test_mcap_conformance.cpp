// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The conformance files of MCAP: every record as the json file beside each has it.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <map>

#include "bags/mcap.h"
#include "bags/message_source.h"
#include "sites.h"

namespace d2s1r::test
{
namespace
{
namespace fs = std::filesystem;
using logs::ByteCursor;
using logs::Bytes;
using nlohmann::json;

/// Names and types of the fields of a record, in order: u8 to u64, text, texts (a map), numbers (a map of 16 bits to
/// 64), bytes (after their length in 32 bits), long (after 64 bits), rest.
using Layout = std::vector<std::pair<const char*, const char*>>;

const std::map<int, std::pair<std::string, Layout>>& layouts()
{
	static const std::map<int, std::pair<std::string, Layout>> all = {
	    {0x01, {"Header", {{"profile", "text"}, {"library", "text"}}}},
	    {0x02, {"Footer", {{"summary_start", "u64"}, {"summary_offset_start", "u64"}, {"summary_crc", "u32"}}}},
	    {0x03, {"Schema", {{"id", "u16"}, {"name", "text"}, {"encoding", "text"}, {"data", "bytes"}}}},
	    {0x04,
	     {"Channel",
	      {{"id", "u16"},
	       {"schema_id", "u16"},
	       {"topic", "text"},
	       {"message_encoding", "text"},
	       {"metadata", "texts"}}}},
	    {0x05,
	     {"Message",
	      {{"channel_id", "u16"},
	       {"sequence", "u32"},
	       {"log_time", "u64"},
	       {"publish_time", "u64"},
	       {"data", "rest"}}}},
	    {0x08,
	     {"ChunkIndex",
	      {{"message_start_time", "u64"},
	       {"message_end_time", "u64"},
	       {"chunk_start_offset", "u64"},
	       {"chunk_length", "u64"},
	       {"message_index_offsets", "numbers"},
	       {"message_index_length", "u64"},
	       {"compression", "text"},
	       {"compressed_size", "u64"},
	       {"uncompressed_size", "u64"}}}},
	    {0x09,
	     {"Attachment",
	      {{"log_time", "u64"}, {"create_time", "u64"}, {"name", "text"}, {"media_type", "text"}, {"data", "long"}}}},
	    {0x0a,
	     {"AttachmentIndex",
	      {{"offset", "u64"},
	       {"length", "u64"},
	       {"log_time", "u64"},
	       {"create_time", "u64"},
	       {"data_size", "u64"},
	       {"name", "text"},
	       {"media_type", "text"}}}},
	    {0x0b,
	     {"Statistics",
	      {{"message_count", "u64"},
	       {"schema_count", "u16"},
	       {"channel_count", "u32"},
	       {"attachment_count", "u32"},
	       {"metadata_count", "u32"},
	       {"chunk_count", "u32"},
	       {"message_start_time", "u64"},
	       {"message_end_time", "u64"},
	       {"channel_message_counts", "numbers"}}}},
	    {0x0c, {"Metadata", {{"name", "text"}, {"metadata", "texts"}}}},
	    {0x0d, {"MetadataIndex", {{"offset", "u64"}, {"length", "u64"}, {"name", "text"}}}},
	    {0x0e, {"SummaryOffset", {{"group_opcode", "u8"}, {"group_start", "u64"}, {"group_length", "u64"}}}},
	    {0x0f, {"DataEnd", {{"data_section_crc", "u32"}}}}};
	return all;
}

json json_of(Bytes bytes)
{
	json numbers = json::array();
	for (std::size_t i = 0; i < bytes.size; i++) numbers.push_back(std::to_string(bytes.data[i]));
	return numbers;
}

json read_field(ByteCursor& cursor, const std::string& type)
{
	if (type == "u8") return std::to_string(cursor.number<std::uint8_t>());
	if (type == "u16") return std::to_string(cursor.number<std::uint16_t>());
	if (type == "u32") return std::to_string(cursor.number<std::uint32_t>());
	if (type == "u64") return std::to_string(cursor.number<std::uint64_t>());
	if (type == "text") return cursor.text();
	if (type == "bytes") return json_of(cursor.take(cursor.number<std::uint32_t>()));
	if (type == "long") return json_of(cursor.take(cursor.number<std::uint64_t>()));
	if (type == "rest") return json_of(cursor.take(cursor.left()));
	json pairs = json::object();
	ByteCursor map(cursor.take(cursor.number<std::uint32_t>()));
	while (map.left() > 0)
	{
		const std::string key = type == "texts" ? map.text() : std::to_string(map.number<std::uint16_t>());
		pairs[key] = type == "texts" ? map.text() : std::to_string(map.number<std::uint64_t>());
	}
	return pairs;
}

/// Adds the record as the json files have it; they leave out the indices of messages.
void add_record(logs::McapOpcode opcode, Bytes content, json& records)
{
	const auto layout = layouts().find(static_cast<int>(opcode));
	if (layout == layouts().end()) return;
	json fields = json::object();
	ByteCursor cursor(content);
	for (const auto& [name, type] : layout->second.second) fields[name] = read_field(cursor, type);
	json pairs = json::array();
	for (const auto& [name, value] : fields.items()) pairs.push_back({name, value});  // by name
	records.push_back({{"type", layout->second.first}, {"fields", pairs}});
}

json records_of(const fs::path& path)
{
	json records = json::array();
	logs::ByteFile file(path.string());
	logs::McapPlace place;
	for (std::uint64_t offset = logs::kMcapMagicSize; place.opcode != logs::McapOpcode::kFooter; offset = place.end())
	{
		place = logs::find_mcap_record(file, offset);
		const Bytes content = file.view(place.content, place.size);
		if (place.opcode != logs::McapOpcode::kChunk)
		{
			add_record(place.opcode, content, records);
			continue;
		}
		const auto chunk = logs::unpack_mcap_chunk(content);
		ByteCursor cursor(Bytes{chunk.records.data(), chunk.records.size()});
		while (cursor.left() > 0)
		{
			const auto record = logs::take_mcap_record(cursor);
			add_record(record.opcode, record.content, records);
		}
	}
	return records;
}
}  // namespace

TEST(McapConformance, RecordsAreThoseOfTheJsonFilesBesideThem)
{
	const fs::path folder = sites_folder() / "logs/mcap_conformance/tests/conformance/data";
	if (!fs::exists(folder)) GTEST_SKIP() << why_skipped(folder);
	std::size_t files = 0;
	for (const auto& entry : fs::recursive_directory_iterator(folder))
	{
		fs::path file = entry.path();
		if (file.extension() != ".mcap") continue;
		const json records = records_of(file);
		const auto source = logs::open_messages(file.string(), logs::RosFormat::kMcap);
		EXPECT_FALSE(source->next());  // their messages are of no type that is needed
		EXPECT_EQ(source->damage(), "") << file;
		std::ifstream expected(file.replace_extension(".json"));
		EXPECT_EQ(records, json::parse(expected)["records"]) << file;
		files++;
	}
	EXPECT_EQ(files, 171U);
}
}  // namespace d2s1r::test
