// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "bags/message_source.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <new>
#include <set>

#include "logs/errors.h"
#include "process_of_file.h"

namespace d2s1r::logs
{
namespace
{
namespace fs = std::filesystem;

constexpr const char* kUnpackAll =
    "is packed, but is read in any order; unpack all files of the folder, by 'zstd -d *.zstd' or as they were packed, "
    "and run again";

/// The files of a folder that ROS recorded, one after the other.
class FolderSource : public MessageSource
{
   public:
	FolderSource(std::vector<std::string> files, Stop stop, bool with_clouds)
	    : files_(std::move(files)), stop_(std::move(stop)), with_clouds_(with_clouds)
	{
	}

	std::optional<Message> next() override
	{
		while (damage_.empty())
		{
			if (!source_ && opened_ == files_.size()) return std::nullopt;
			if (!source_) source_ = open_file(files_[opened_++]);
			auto message = source_->next();
			if (message) return message;
			damage_ = source_->damage();
			if (unread_scans_.empty()) unread_scans_ = source_->unread_scans();
			if (!damage_.empty() && files_.size() > 1)
				damage_ = fs::path(files_[opened_ - 1]).filename().string() + " in it: " + damage_;
			source_.reset();
		}
		return std::nullopt;
	}

   private:
	std::unique_ptr<MessageSource> open_file(const std::string& file) const
	{
		const auto format = recognize_ros(file);
		if (!format)
		{
			const bool is_packed = !describe_packed(first_bytes(file), "").empty();
			throw LogError(
			    file, is_packed ? kUnpackAll
			                    : "is neither a sqlite3 nor an MCAP file nor a ROS 1 bag; copy the whole folder");
		}
		return open_messages(file, *format, stop_, with_clouds_);
	}

	std::vector<std::string> files_;
	Stop stop_;
	bool with_clouds_;
	std::size_t opened_ = 0;
	std::unique_ptr<MessageSource> source_;
};

/// The first letter of what the process sends that reads metadata.
enum MetadataRecord : char
{
	kNameRecord = 'n',  //!< the name of a file
	kErrorRecord = 'e'  //!< why the metadata cannot be read
};

constexpr const char* kNameTheFile = "; name the file in its folder that has the messages";

std::string text_of_metadata(const std::string& path)
{
	constexpr std::uint64_t kLongestMetadata = 1 << 22;  // [byte] thousands of files and topics
	std::error_code error;
	if (!fs::is_regular_file(path, error))
		throw LogError(path, "is a folder, a device or a pipe, or is missing" + std::string(kNameTheFile));
	try
	{
		ByteFile file(path);
		if (file.size() > kLongestMetadata)
			throw Unreadable("is too large for the metadata of a bag" + std::string(kNameTheFile));
		const Bytes bytes = file.view(0, file.size());
		return {reinterpret_cast<const char*>(bytes.data), bytes.size};
	}
	catch (const Unreadable& e)
	{
		throw LogError(path, e.what());
	}
}

/// Returns a file, or the one without its ending of packed files if that is there.
fs::path unpacked_beside(const fs::path& file)
{
	std::error_code error;
	fs::path unpacked = file;
	if (file.extension() == ".zstd" || file.extension() == ".zst") unpacked.replace_extension();
	return fs::is_regular_file(unpacked, error) ? unpacked : file;
}

/// Returns whether a file is called as a recording of ROS that a folder may have several of.
bool is_recording(const fs::path& file)
{
	return file.extension() == ".mcap" || file.extension() == ".db3" || file.extension() == ".bag";
}

/// Orders names as people do, "bag_2" before "bag_10".
bool comes_before(const std::string& a, const std::string& b)
{
	const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
	const auto number_end = [&](const std::string& text, std::size_t at)
	{
		return static_cast<std::size_t>(
		    std::find_if_not(text.begin() + static_cast<std::ptrdiff_t>(at), text.end(), is_digit) - text.begin());
	};
	std::size_t i = 0, j = 0;
	while (i < a.size() && j < b.size())
	{
		if (!is_digit(a[i]) || !is_digit(b[j]))
		{
			if (a[i] != b[j]) return a[i] < b[j];
			i++, j++;
			continue;
		}
		while (i < a.size() && a[i] == '0') i++;
		while (j < b.size() && b[j] == '0') j++;
		const std::size_t end = number_end(a, i), other_end = number_end(b, j);
		if (end - i != other_end - j) return end - i < other_end - j;
		const int order = a.compare(i, end - i, b, j, other_end - j);
		if (order != 0) return order < 0;
		i = end, j = other_end;
	}
	return a.size() - i < b.size() - j;
}

void tell_names(const std::string& text, const Send& send)
{
	try
	{
		const YAML::Node yaml = YAML::Load(text);
		for (const auto& name : yaml["rosbag2_bagfile_information"]["relative_file_paths"])
			send(char{kNameRecord} + name.as<std::string>());
	}
	catch (const YAML::Exception& e)
	{
		send(char{kErrorRecord} + std::string(e.what()));
	}
}

/// Returns the names that metadata.yaml lists. yaml-cpp reads it in a process of its own: some files take 500 times
/// their size of memory, and seconds in which nothing can be asked to stop.
/// \throws LogError, Interrupted
std::vector<std::string> names_in_metadata(const std::string& metadata, const Stop& stop)
{
	constexpr ProcessLimits kLimits = {600'000'000, 20};
	const auto refuse = [&](const std::string& why)
	{ throw LogError(metadata, "is not the metadata of a ROS 2 bag (" + why + ")" + kNameTheFile); };
	const std::string text = text_of_metadata(metadata);
	std::vector<std::string> names;
	std::string error;
	const ProcessEnd end = read_in_own_process(
	    metadata, kLimits, [&](const Send& send) { tell_names(text, send); },
	    [&](const std::string& record)
	    {
		    if (record[0] == kErrorRecord)
			    error = record.substr(1);
		    else
			    names.push_back(record.substr(1));
	    },
	    stop);
	if (end == ProcessEnd::kInterrupted) throw Interrupted();
	if (!error.empty()) refuse(error);
	if (end == ProcessEnd::kOutOfMemory && available_memory() < kLimits.memory) throw std::bad_alloc();
	if (end != ProcessEnd::kDone) refuse("reading it takes too much memory or time");
	return names;
}

std::vector<std::string> files_of_metadata(const fs::path& folder, const Stop& stop)
{
	const std::string metadata = (folder / "metadata.yaml").string();
	std::vector<std::string> files;
	std::set<std::string> seen;
	std::error_code error;  // of names that are too long, or that nobody may look up: the files count as missing
	const auto ask_to_stop = [&]
	{
		if (stop()) throw Interrupted();
	};
	for (const std::string& name : names_in_metadata(metadata, stop))
	{
		ask_to_stop();
		fs::path file = unpacked_beside(folder / name);
		if (!fs::exists(file, error)) file = unpacked_beside(folder / file.filename());  // old ones name the folder
		if (!seen.insert(file.string()).second) throw LogError(metadata, "names '" + name + "' twice" + kNameTheFile);
		files.push_back(file.string());
	}
	if (files.empty()) throw LogError(metadata, "has no relative_file_paths" + std::string(kNameTheFile));
	for (const auto& file : files)
	{
		ask_to_stop();
		if (!fs::is_regular_file(file, error))
			throw LogError(file, "is missing, though metadata.yaml names it; copy the whole folder");
	}
	return files;
}

/// [byte] of memory that a message takes while it waits.
std::size_t bytes_of(Bytes data)
{
	constexpr std::size_t kOfEach = 200;  // [byte] besides its data
	return data.size + kOfEach;
}
}  // namespace

MessageKind kind_of_type(const std::string& type, bool with_clouds)
{
	if (type.size() > kLongestType) return MessageKind::kOther;
	std::string short_type = type;
	const auto replace = [&](const std::string& what, const std::string& by)
	{
		for (auto at = short_type.find(what); at != std::string::npos; at = short_type.find(what))
			short_type.replace(at, what.size(), by);
	};
	replace("::", "/");
	if (short_type.find("/dds_/") != std::string::npos && short_type.back() == '_') short_type.pop_back();
	replace("/dds_/", "/");
	replace("/msg/", "/");
	if (short_type == "sensor_msgs/LaserScan") return MessageKind::kLaserScan;
	if (short_type == "sensor_msgs/MultiEchoLaserScan") return MessageKind::kMultiEchoLaserScan;
	if (short_type == "sensor_msgs/PointCloud2") return with_clouds ? MessageKind::kPointCloud : MessageKind::kOther;
	if (short_type == "nav_msgs/Odometry") return MessageKind::kOdometry;
	if (short_type == "geometry_msgs/PoseStamped" || short_type == "geometry_msgs/PoseWithCovarianceStamped")
		return MessageKind::kStampedPose;
	if (short_type == "tf2_msgs/TFMessage" || short_type == "tf/tfMessage") return MessageKind::kTransforms;
	return MessageKind::kOther;
}

void MessageSource::note_unread(const std::string& topic, const std::string& type)
{
	const std::string start = type.substr(0, kLongestType);
	std::string letters;
	for (const char c : start)
		if (c != '_') letters += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
	if (unread_scans_.empty() && letters.find("laserscan") != std::string::npos)
		unread_scans_ = start + " on the topic '" + topic.substr(0, kLongestType) + "'";
}

std::string describe_damage(const std::exception& error)
{
	if (dynamic_cast<const Interrupted*>(&error)) throw Interrupted();
	if (is_out_of_memory(error)) throw std::bad_alloc();
	if (dynamic_cast<const Unreadable*>(&error)) return one_line(error);
	return "is damaged or cut short (" + one_line(error) + "); copy or record the log again";
}

std::shared_ptr<const Topic> MessageSource::keep(Topic topic)
{
	constexpr std::size_t kOfEach = 200;  // [byte] besides its name
	if (topic.kind == MessageKind::kOther) topic.name.clear();
	topic_bytes_ += topic.name.size() + kOfEach;
	if (topic_bytes_ > kMostBytesOfTopics)
		throw Unreadable("is damaged (the names of its topics take too much memory); copy or record the log again");
	return std::make_shared<const Topic>(std::move(topic));
}

void MessageSource::unpack_message(Message& message, std::uint64_t file_size)
{
	constexpr std::uint64_t kOfAnyFile = 2 * kMostBytesAtOnce, kTimesTheFile = 1000;  // far more than scans pack to
	if (message.topic->encoding != Encoding::kCdr || method_of(message.data) != "zstd") return;
	const auto unpacked = std::make_shared<const std::vector<std::uint8_t>>(unpack("zstd", message.data, {}));
	unpacked_bytes_ += unpacked->size();
	if (unpacked_bytes_ > kOfAnyFile + kTimesTheFile * file_size)
		throw Unreadable(
		    "is damaged (its packed messages take more than a thousand times its size); copy or record the log again");
	message.data = {unpacked->data(), unpacked->size()};
	message.owner = unpacked;
}

void PieceSource::ask_to_stop() const
{
	if (stop_()) throw Interrupted();
}

void PieceSource::set_pieces(std::vector<Piece> pieces, std::string damage, std::uint64_t file_size)
{
	file_size_ = file_size;
	pieces_ = std::move(pieces);
	std::stable_sort(
	    pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) { return a.first_time < b.first_time; });
	damage_at_end_ = std::move(damage);
}

bool PieceSource::must_load() const
{
	if (next_piece_ == pieces_.size()) return false;
	return waiting_.empty() || pieces_[next_piece_].first_time <= waiting_.top().message.time;
}

void PieceSource::load_next_piece()
{
	ask_to_stop();
	load(
	    pieces_[next_piece_++],
	    [this](const std::shared_ptr<const Topic>& topic, std::int64_t time, Bytes data) { add(topic, time, data); });
}

/// A message that waits holds a copy of its own bytes only: its piece may be many times as large.
void PieceSource::add(const std::shared_ptr<const Topic>& topic, std::int64_t time, Bytes data)
{
	ask_to_stop();  // a piece may hold a million messages
	waiting_bytes_ += bytes_of(data);
	if (waiting_bytes_ > kMostBytesWaiting)
		throw Unreadable(
		    "is damaged, or its chunks are out of order (more than " + std::to_string(kMostBytesWaiting / 1'000'000) +
		    " MB of messages would wait for others that were recorded before them); write the log again in the order "
		    "of its times");
	auto owner = std::make_shared<const std::vector<std::uint8_t>>(data.data, data.data + data.size);
	const Bytes copy{owner->data(), owner->size()};
	waiting_.push({{topic, time, copy, std::move(owner)}, loaded_++});
}

std::optional<Message> PieceSource::next()
{
	try
	{
		ask_to_stop();  // a second of work may be in a message that waits
		while (must_load()) load_next_piece();
	}
	catch (const std::exception& e)
	{
		damage_at_end_ = describe_damage(e);
		next_piece_ = pieces_.size();
	}
	if (waiting_.empty())
	{
		damage_ = damage_at_end_;
		return std::nullopt;
	}
	Message first = waiting_.top().message;
	waiting_.pop();
	waiting_bytes_ -= bytes_of(first.data);
	try
	{
		unpack_message(first, file_size_);
	}
	catch (const std::exception& e)
	{
		damage_ = describe_damage(e);
		return std::nullopt;
	}
	return first;
}

std::optional<RosFormat> recognize_ros(Bytes start)
{
	const std::string text(reinterpret_cast<const char*>(start.data), start.size);
	const auto starts_with = [&](const std::string& magic) { return text.compare(0, magic.size(), magic) == 0; };
	if (starts_with("#ROSBAG V") || starts_with("#ROSRECORD V")) return RosFormat::kBag1;
	if (starts_with("SQLite format 3")) return RosFormat::kSqlite;
	if (starts_with("\x89MCAP")) return RosFormat::kMcap;
	return std::nullopt;
}

std::string describe_packed(const std::string& start, const std::string& unpacked_start)
{
	const auto bytes = [](const std::string& text) {
		return Bytes{reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
	};
	if (method_of(bytes(start)) == "zstd")
		return "is packed as a whole by zstd, but is read in any order; unpack it by 'zstd -d' and run again";
	const char* const tool = start.rfind("BZh", 0) == 0 ? "bunzip2" : "gunzip";
	if (recognize_ros(bytes(start)) || !recognize_ros(bytes(unpacked_start))) return "";
	return std::string("is a recording of ROS that was packed as a whole, but is read in any order; unpack it by '") +
	       tool + "' and run again";
}

std::vector<std::string> files_of_bag(const std::string& folder)
{
	std::map<std::string, std::vector<std::string>> files;  // by their endings
	std::string packed;
	std::error_code error;
	for (const auto& entry : fs::directory_iterator(folder, error))
	{
		if (!entry.is_regular_file(error)) continue;
		const fs::path& file = entry.path();
		if (is_recording(file)) files[file.extension().string()].push_back(file.string());
		if (is_recording(file.stem())) packed = file.string();
	}
	if (files.size() > 1)
		throw LogError(
		    folder, "has files " + files.begin()->first + " and " + files.rbegin()->first +
		                ", and no metadata.yaml that says which to read; name a file");
	if (files.empty() && !packed.empty()) throw LogError(packed, kUnpackAll);
	if (files.empty()) return {};
	auto& found = files.begin()->second;
	std::sort(found.begin(), found.end(), comes_before);
	return found;
}

std::optional<RosFormat> recognize_ros(const std::string& path)
{
	if (fs::is_directory(path)) return RosFormat::kFolder;
	const std::string start = first_bytes(path);
	return recognize_ros({reinterpret_cast<const std::uint8_t*>(start.data()), start.size()});
}

std::unique_ptr<MessageSource> open_messages(
    const std::string& path, RosFormat format, const Stop& stop, bool with_clouds)
{
	switch (format)
	{
		case RosFormat::kBag1:
			return open_bag1(path, stop, with_clouds);
		case RosFormat::kSqlite:
			return open_sqlite(path, stop, with_clouds);
		case RosFormat::kMcap:
			return open_mcap(path, stop, with_clouds);
		case RosFormat::kFolder:
			break;
	}
	return open_files(files_of_folder(path, stop), stop, with_clouds);
}

std::vector<std::string> files_of_folder(const std::string& folder, const Stop& stop)
{
	std::error_code error;
	const bool has_metadata = fs::exists(fs::path(folder) / "metadata.yaml", error);
	return has_metadata ? files_of_metadata(folder, stop) : files_of_bag(folder);
}

std::unique_ptr<MessageSource> open_files(const std::vector<std::string>& files, const Stop& stop, bool with_clouds)
{
	return std::make_unique<FolderSource>(files, stop, with_clouds);
}
}  // namespace d2s1r::logs
