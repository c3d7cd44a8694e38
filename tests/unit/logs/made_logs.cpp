// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "logs/made_logs.h"

#ifdef D2S1R_BZ2
#include <bzlib.h>
#endif
#ifdef D2S1R_LZ4
#include <lz4frame.h>
#endif
#ifdef D2S1R_ZSTD
#include <zstd.h>
#endif
#ifdef D2S1R_SQLITE
#include <sqlite3.h>
#endif

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <stdexcept>

namespace d2s1r::test
{
namespace
{
template <typename Number>
std::string little(Number value)
{
	return {reinterpret_cast<const char*>(&value), sizeof value};
}

std::string with_length(const std::string& bytes)
{
	return little(static_cast<std::uint32_t>(bytes.size())) + bytes;
}

std::string ros1_time(std::int64_t nanoseconds)
{
	return little(static_cast<std::uint32_t>(nanoseconds / 1'000'000'000)) +
	       little(static_cast<std::uint32_t>(nanoseconds % 1'000'000'000));
}

using Fields = std::vector<std::pair<std::string, std::string>>;

std::string fields_of(const Fields& fields)
{
	std::string header;
	for (const auto& [name, value] : fields) header += with_length(name + "=" + value);
	return header;
}

std::string bag_record(const Fields& fields, const std::string& data)
{
	return with_length(fields_of(fields)) + with_length(data);
}

/// Consecutive messages, `size` at a time, in the order that is asked for.
std::vector<std::vector<MadeMessage>> chunks_of(const std::vector<MadeMessage>& messages, const Packing& packing)
{
	std::vector<std::vector<MadeMessage>> chunks;
	for (std::size_t i = 0; i < messages.size(); i++)
	{
		if (i % packing.messages_in_chunk == 0) chunks.emplace_back();
		chunks.back().push_back(messages[i]);
	}
	if (packing.chunk_order.empty()) return chunks;
	std::vector<std::vector<MadeMessage>> ordered;
	for (const std::size_t i : packing.chunk_order) ordered.push_back(chunks.at(i));
	return ordered;
}

std::string bag_connection(std::uint32_t number, const MadeMessage& message)
{
	return bag_record(
	    {{"op", "\x07"}, {"conn", little(number)}, {"topic", message.topic}},
	    fields_of({{"topic", message.topic}, {"type", message.type}, {"md5sum", "*"}, {"message_definition", ""}}));
}

std::string mcap_record(std::uint8_t opcode, const std::string& content)
{
	return static_cast<char>(opcode) + little(std::uint64_t{content.size()}) + content;
}

std::string mcap_message(std::uint16_t channel, const MadeMessage& message)
{
	return mcap_record(
	    5, little(channel) + little(std::uint32_t{0}) + little(message.time) + little(message.time) + message.data);
}

std::string mcap_channel(std::uint16_t number, const MadeMessage& message, const std::string& encoding)
{
	const std::string schema = little(number) + with_length(message.type) + with_length("ros2msg") + with_length("");
	const std::string channel =
	    little(number) + little(number) + with_length(message.topic) + with_length(encoding) + with_length("");
	return mcap_record(3, schema) + mcap_record(4, channel);
}

std::string mcap_chunk(const std::string& records, const std::vector<MadeMessage>& messages, const std::string& method)
{
	const auto [first, last] = std::minmax_element(
	    messages.begin(), messages.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
	const auto checksum =
	    static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(records.data()), records.size()));
	const std::string content = packed(method, records);
	return mcap_record(
	    6, little(first->time) + little(last->time) + little(std::uint64_t{records.size()}) + little(checksum) +
	           with_length(method) + little(std::uint64_t{content.size()}) + content);
}

template <typename Messages>
std::map<std::string, std::uint32_t> numbers_of_topics(const Messages& messages)
{
	std::map<std::string, std::uint32_t> numbers;
	for (const auto& message : messages) numbers.emplace(message.topic, static_cast<std::uint32_t>(numbers.size() + 1));
	return numbers;
}
}  // namespace

FieldWriter::FieldWriter(Wire wire) : wire_(wire)
{
	if (wire == Wire::kRos1) return;
	bytes_ = std::string(4, '\0');
	bytes_[1] = static_cast<char>(wire == Wire::kCdr ? 1 : wire == Wire::kCdr2 ? 7 : 0);
}

void FieldWriter::align(std::size_t size)
{
	if (wire_ == Wire::kRos1) return;
	if (wire_ == Wire::kCdr2) size = std::min<std::size_t>(size, 4);
	while ((bytes_.size() - 4) % size != 0) bytes_ += '\0';
}

FieldWriter& FieldWriter::text(const std::string& text)
{
	const std::string end = wire_ == Wire::kRos1 ? "" : std::string(1, '\0');
	number(static_cast<std::uint32_t>(text.size() + end.size()));
	bytes_ += text + end;
	return *this;
}

FieldWriter& FieldWriter::header(std::int64_t nanoseconds, const std::string& frame)
{
	if (wire_ == Wire::kRos1) number(std::uint32_t{7});  // its number in the sequence
	number(static_cast<std::uint32_t>(nanoseconds / 1'000'000'000));
	number(static_cast<std::uint32_t>(nanoseconds % 1'000'000'000));
	return text(frame);
}

std::string scan_message(Wire wire, const MadeScan& scan)
{
	FieldWriter writer(wire);
	writer.header(scan.time, scan.frame);
	const float last =
	    scan.last_angle.value_or(scan.first_angle + scan.angle_step * static_cast<float>(scan.ranges.size() - 1));
	for (const float value :
	     {scan.first_angle, last, scan.angle_step, scan.time_step, scan.scan_time, scan.min_range, scan.max_range})
		writer.number(value);
	writer.number(static_cast<std::uint32_t>(scan.ranges.size()));
	for (const float range : scan.ranges) writer.number(range);
	return writer.number(std::uint32_t{0}).bytes();  // no intensities
}

std::string cloud_message(Wire wire, const MadeCloud& cloud)
{
	constexpr std::uint32_t kIntensity = 4;  // [byte] after the coordinates
	const std::uint32_t size = cloud.are_double ? 8 : 4, time_at = 3 * size + kIntensity;
	const std::uint32_t point_size = time_at + (cloud.time_field.empty() ? 0 : cloud.time_type == 8 ? 8 : 4);
	const auto columns = static_cast<std::uint32_t>(cloud.points.size()) / cloud.rows;
	std::string data;
	const auto add = [&](auto value)
	{
		std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
		if (cloud.is_big_endian) std::reverse(bytes.begin(), bytes.end());
		data += bytes;
	};
	for (std::size_t i = 0; i < cloud.points.size(); i++)
	{
		for (const double value : cloud.points[i])
			if (cloud.are_double)
				add(value);
			else
				add(static_cast<float>(value));
		data += std::string(kIntensity, '!');
		if (!cloud.time_field.empty() && cloud.time_type == 6) add(static_cast<std::uint32_t>(cloud.times[i]));
		if (!cloud.time_field.empty() && cloud.time_type == 7) add(static_cast<float>(cloud.times[i]));
		if (!cloud.time_field.empty() && cloud.time_type == 8) add(cloud.times[i]);
		if ((i + 1) % columns == 0) data += std::string(cloud.row_gap, '?');
	}
	data.resize(data.size() - cloud.missing_data);
	FieldWriter writer(wire);
	writer.header(cloud.time, cloud.frame).number(cloud.rows).number(columns);
	writer.number(static_cast<std::uint32_t>(cloud.fields.size() + (cloud.time_field.empty() ? 0 : 1)));
	if (!cloud.time_field.empty())
		writer.text(cloud.time_field).number(time_at).number(cloud.time_type).number(std::uint32_t{1});
	std::uint32_t offset = 0;
	for (const std::string& field : cloud.fields)
	{
		const int type = cloud.field_type != 0 ? cloud.field_type : cloud.are_double ? 8 : 7;
		writer.text(field).number(offset).number(static_cast<std::uint8_t>(type)).number(cloud.field_count);
		offset += size;
	}
	writer.number(std::uint8_t{cloud.is_big_endian});
	writer.number(cloud.point_step != 0 ? cloud.point_step : point_size);
	writer.number(columns * point_size + cloud.row_gap).number(static_cast<std::uint32_t>(data.size()));
	for (const char byte : data) writer.number(byte);
	return writer.number(std::uint8_t{0}).bytes();
}

std::string odometry_message(Wire wire, std::int64_t time, const std::string& child, double x, double y, double phi)
{
	FieldWriter writer(wire);
	writer.header(time, "odom").text(child);
	for (const double value : {x, y, 0.0, 0.0, 0.0, std::sin(phi / 2), std::cos(phi / 2)}) writer.number(value);
	for (int i = 0; i < 36; i++) writer.number(0.5);
	for (const double value : {0.25, 0.0, 0.0, 0.0, 0.0, 0.125}) writer.number(value);
	for (int i = 0; i < 36; i++) writer.number(0.5);
	return writer.bytes();
}

std::string transform_message(Wire wire, std::int64_t time, const std::vector<MadeTransform>& transforms)
{
	FieldWriter writer(wire);
	writer.number(static_cast<std::uint32_t>(transforms.size()));
	for (const MadeTransform& transform : transforms)
	{
		writer.header(time, transform.parent).text(transform.child);
		for (const double value : {transform.x, transform.y, transform.z}) writer.number(value);
		for (const char axis : {'x', 'y', 'z'})
			writer.number(axis == transform.axis ? std::sin(transform.angle / 2) : 0.0);
		writer.number(std::cos(transform.angle / 2));
	}
	return writer.bytes();
}

MadeMessage made_scan(Wire wire, const MadeScan& scan, const std::string& topic)
{
	const char* type = wire != Wire::kRos1 ? "sensor_msgs/msg/LaserScan" : "sensor_msgs/LaserScan";
	return {topic, type, scan.time, scan_message(wire, scan)};
}

MadeMessage made_cloud(Wire wire, const MadeCloud& cloud, const std::string& topic)
{
	const char* type = wire != Wire::kRos1 ? "sensor_msgs/msg/PointCloud2" : "sensor_msgs/PointCloud2";
	return {topic, type, cloud.time, cloud_message(wire, cloud)};
}

MadeMessage made_odometry(Wire wire, std::int64_t time, double x, double y, double phi)
{
	const char* type = wire != Wire::kRos1 ? "nav_msgs/msg/Odometry" : "nav_msgs/Odometry";
	return {"/odom", type, time, odometry_message(wire, time, "base_link", x, y, phi)};
}

MadeMessage made_pose(Wire wire, bool has_covariance, std::int64_t time, double x, double y, double phi)
{
	FieldWriter writer(wire);
	writer.header(time, "map");
	for (const double value : {x, y, 0.0, 0.0, 0.0, std::sin(phi / 2), std::cos(phi / 2)}) writer.number(value);
	for (int i = 0; has_covariance && i < 36; i++) writer.number(0.5);
	const std::string package = wire != Wire::kRos1 ? "geometry_msgs/msg/" : "geometry_msgs/";
	if (has_covariance) return {"/amcl_pose", package + "PoseWithCovarianceStamped", time, writer.bytes()};
	return {"/pose", package + "PoseStamped", time, writer.bytes()};
}

MadeMessage made_transforms(
    Wire wire, std::int64_t time, const std::vector<MadeTransform>& transforms, const std::string& topic)
{
	const char* type = wire != Wire::kRos1 ? "tf2_msgs/msg/TFMessage" : "tf2_msgs/TFMessage";
	return {topic, type, time, transform_message(wire, time, transforms)};
}

std::string bag1_file(const std::vector<MadeMessage>& messages, const Packing& packing)
{
	auto numbers = numbers_of_topics(messages);
	std::string file = "#ROSBAG V2.0\n";
	file += bag_record(
	    {{"op", "\x03"},
	     {"index_pos", little(std::uint64_t{0})},
	     {"conn_count", little(std::uint32_t{0})},
	     {"chunk_count", little(std::uint32_t{0})}},
	    std::string(100, ' '));
	for (const auto& chunk : chunks_of(messages, packing))
	{
		std::string records;
		std::map<std::uint32_t, std::string> index;
		for (const auto& message : chunk)
		{
			const std::uint32_t number = numbers[message.topic];
			if (index[number].empty()) records += bag_connection(number, message);
			index[number] += ros1_time(message.time) + little(static_cast<std::uint32_t>(records.size()));
			records +=
			    bag_record({{"op", "\x02"}, {"conn", little(number)}, {"time", ros1_time(message.time)}}, message.data);
		}
		file += bag_record(
		    {{"op", "\x05"},
		     {"compression", packing.method.empty() ? "none" : packing.method},
		     {"size", little(static_cast<std::uint32_t>(records.size()))}},
		    packed(packing.method, records));
		if (!packing.with_index) continue;
		for (const auto& [number, entries] : index)
			file += bag_record(
			    {{"op", "\x04"},
			     {"ver", little(std::uint32_t{1})},
			     {"conn", little(number)},
			     {"count", little(static_cast<std::uint32_t>(entries.size() / 12))}},
			    entries);
	}
	return file;
}

std::string mcap_file(const std::vector<MadeMessage>& messages, const Packing& packing, const std::string& encoding)
{
	const std::string magic = "\x89MCAP0\r\n";
	auto numbers = numbers_of_topics(messages);
	std::string file = magic + mcap_record(1, with_length("") + with_length("made"));
	std::string known, channels;
	const auto records_of = [&](const std::vector<MadeMessage>& some)
	{
		std::string records;
		for (const auto& message : some)
		{
			const auto number = static_cast<std::uint16_t>(numbers[message.topic]);
			if (known.find("<" + message.topic + ">") == std::string::npos)
			{
				known += "<" + message.topic + ">";
				channels += mcap_channel(number, message, encoding);
				records += mcap_channel(number, message, encoding);
			}
			records += mcap_message(number, message);
		}
		return records;
	};
	if (packing.messages_in_chunk == 0)
		file += records_of(messages);
	else
		for (const auto& chunk : chunks_of(messages, packing))
			file += mcap_chunk(records_of(chunk), chunk, packing.method);
	file += mcap_record(15, little(std::uint32_t{0}));
	if (packing.with_index) file += channels;
	return file + mcap_record(2, std::string(20, '\0')) + magic;
}

void save_sqlite_bag(const std::string& path, const std::vector<MadeMessage>& messages)
{
#ifdef D2S1R_SQLITE
	std::filesystem::remove(path);
	sqlite3* database = nullptr;
	sqlite3_open(path.c_str(), &database);
	const auto run = [&](const std::string& sql)
	{
		if (sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
			throw std::runtime_error(sqlite3_errmsg(database));
	};
	const auto quoted = [](const std::string& text) { return "'" + text + "'"; };
	run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT "
	    "NOT NULL, offered_qos_profiles TEXT NOT NULL);"
	    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data "
	    "BLOB "
	    "NOT NULL); CREATE INDEX timestamp_idx ON messages (timestamp ASC);");
	auto numbers = numbers_of_topics(messages);
	for (const auto& message : messages)
	{
		const std::string number = std::to_string(numbers[message.topic]);
		run("INSERT OR IGNORE INTO topics VALUES(" + number + "," + quoted(message.topic) + "," + quoted(message.type) +
		    ",'cdr','')");
		std::string hex;
		for (const char c : message.data)
		{
			constexpr const char* kDigits = "0123456789abcdef";
			hex += kDigits[static_cast<unsigned char>(c) / 16];
			hex += kDigits[static_cast<unsigned char>(c) % 16];
		}
		run("INSERT INTO messages(topic_id, timestamp, data) VALUES(" + number + "," + std::to_string(message.time) +
		    ",x" + quoted(hex) + ")");
	}
	sqlite3_close(database);
#else
	(void)path, (void)messages;
#endif
}

void alter_sqlite_bag(const std::string& path, const std::string& statements)
{
#ifdef D2S1R_SQLITE
	sqlite3* database = nullptr;
	sqlite3_open(path.c_str(), &database);
	const bool done = sqlite3_exec(database, statements.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK;
	const std::string error = sqlite3_errmsg(database);
	sqlite3_close(database);
	if (!done) throw std::runtime_error(error);
#else
	(void)path, (void)statements;
#endif
}

std::string packed(const std::string& method, const std::string& bytes)
{
#ifdef D2S1R_BZ2
	if (method == "bz2")
	{
		std::string result(bytes.size() + bytes.size() / 50 + 1000, '\0');
		auto size = static_cast<unsigned>(result.size());
		std::string source = bytes;
		BZ2_bzBuffToBuffCompress(result.data(), &size, source.data(), static_cast<unsigned>(source.size()), 9, 0, 0);
		result.resize(size);
		return result;
	}
#endif
#ifdef D2S1R_LZ4
	if (method == "lz4")
	{
		std::string result(LZ4F_compressFrameBound(bytes.size(), nullptr), '\0');
		result.resize(LZ4F_compressFrame(result.data(), result.size(), bytes.data(), bytes.size(), nullptr));
		return result;
	}
#endif
#ifdef D2S1R_ZSTD
	if (method == "zstd")
	{
		std::string result(ZSTD_compressBound(bytes.size()), '\0');
		result.resize(ZSTD_compress(result.data(), result.size(), bytes.data(), bytes.size(), 3));
		return result;
	}
	if (method == "zstd-stream")
	{
		std::string result(ZSTD_compressBound(bytes.size()), '\0');
		ZSTD_CCtx* const context = ZSTD_createCCtx();
		ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, 0);
		result.resize(ZSTD_compress2(context, result.data(), result.size(), bytes.data(), bytes.size()));
		ZSTD_freeCCtx(context);
		return result;
	}
#endif
	return bytes;
}

bool can_pack(const std::string& method)
{
	const std::string example(1000, 'a');
	return packed(method, example) != example;
}
}  // namespace d2s1r::test
