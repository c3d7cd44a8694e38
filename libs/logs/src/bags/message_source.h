// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/own_process.h>
#include <ros/messages.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <queue>
#include <string>
#include <vector>

#include "bags/byte_file.h"

namespace d2s1r::logs
{
using ros::Encoding;

/// Says which of the messages that localization needs it is; all others are passed over.
enum class MessageKind
{
	kLaserScan,           //!< sensor_msgs/LaserScan
	kMultiEchoLaserScan,  //!< sensor_msgs/MultiEchoLaserScan
	kOdometry,            //!< nav_msgs/Odometry
	kPointCloud,          //!< sensor_msgs/PointCloud2
	kStampedPose,         //!< geometry_msgs/PoseStamped and PoseWithCovarianceStamped
	kTransforms,          //!< tf2_msgs/TFMessage and tf/tfMessage
	kOther
};

/// Says how many letters of the name of a type are looked at: no type that is read has a longer one.
inline constexpr std::size_t kLongestType = 100;

/// Returns the kind of a type of messages.
/// \param type as ROS 1, ROS 2 ("sensor_msgs/msg/LaserScan") or DDS ("sensor_msgs::msg::dds_::LaserScan_") names it
/// \param with_clouds whether point clouds are needed
MessageKind kind_of_type(const std::string& type, bool with_clouds = false);

struct Topic
{
	std::string name;
	MessageKind kind = MessageKind::kOther;
	Encoding encoding = Encoding::kCdr;
};

struct Message
{
	std::shared_ptr<const Topic> topic;
	std::int64_t time = 0;                                   //!< [ns] since the epoch, when it was recorded
	Bytes data;                                              //!< unpacked, without the encapsulation of the recorder
	std::shared_ptr<const std::vector<std::uint8_t>> owner;  //!< of the data, and of nothing else
};

/// Messages of a recording by the time of their recording; kOther never appears.
class MessageSource
{
   public:
	virtual ~MessageSource() = default;

	/// Returns the next message, or no value at the end, which is a clean one if damage() is empty.
	/// \throws Interrupted if the caller asked to stop, see open_messages()
	virtual std::optional<Message> next() = 0;

	/// Returns what stopped the reading before the end of the file, and what to do; else an empty text.
	const std::string& damage() const { return damage_; }

	/// Returns the first topic of scans that are of another type than those that are read, for people; else an empty
	/// text.
	const std::string& unread_scans() const { return unread_scans_; }

   protected:
	/// Tells of a topic that is not read if its type is called a scan of a laser.
	void note_unread(const std::string& topic, const std::string& type);

	/// Returns a topic that is kept until the end; the name of one of other messages is not kept.
	/// \throws Unreadable if the topics of the file take more than kMostBytesOfTopics
	std::shared_ptr<const Topic> keep(Topic topic);

	/// Unpacks a message that was packed by itself, as rosbag2 may do.
	/// \param file_size [byte]
	/// \throws std::runtime_error if it is damaged, Unreadable if the messages take far more than a file of this size
	///         would hold
	void unpack_message(Message& message, std::uint64_t file_size);

	std::string damage_;
	std::string unread_scans_;

   private:
	std::size_t topic_bytes_ = 0;       //!< [byte] of memory that the topics take
	std::uint64_t unpacked_bytes_ = 0;  //!< [byte] of the messages that were packed by themselves
};

/// Says how much memory [byte] the topics of a file may take.
inline constexpr std::size_t kMostBytesOfTopics = 16'000'000;

/// Returns what MessageSource::damage() says about an error of a reader.
/// \throws Interrupted or std::bad_alloc if the error is that, which is no damage
std::string describe_damage(const std::exception& error);

struct Piece
{
	std::uint64_t offset = 0;     //!< [byte]
	std::uint64_t size = 0;       //!< [byte]
	std::int64_t first_time = 0;  //!< [ns] of its messages
};

/// Says how much memory [byte] the messages of a file may take that wait for those which were recorded before them.
inline constexpr std::size_t kMostBytesWaiting = 256'000'000;

/// Orders the messages of a file whose pieces are in no order and overlap in time. It holds the messages of the pieces
/// that overlap; if these would take more than kMostBytesWaiting, the reading ends there, as in a damaged file.
class PieceSource : public MessageSource
{
   public:
	/// \param stop is asked for each record that is looked at
	explicit PieceSource(Stop stop) : stop_(std::move(stop)) {}

	std::optional<Message> next() final;

   protected:
	using Add = std::function<void(const std::shared_ptr<const Topic>& topic, std::int64_t time, Bytes data)>;

	void ask_to_stop() const;

	/// Call once, before next(). \param damage what is said when the pieces are through
	/// \param file_size [byte]
	void set_pieces(std::vector<Piece> pieces, std::string damage, std::uint64_t file_size);

	/// Hands the messages of a piece to `add`, in any order; their data is copied there.
	virtual void load(const Piece& piece, const Add& add) = 0;

   private:
	struct Waiting
	{
		Message message;
		std::size_t number = 0;  //!< [-] messages of the same time stay in the order in which they were loaded
	};
	struct IsLater
	{
		bool operator()(const Waiting& a, const Waiting& b) const
		{
			return a.message.time != b.message.time ? a.message.time > b.message.time : a.number > b.number;
		}
	};
	bool must_load() const;
	void load_next_piece();
	void add(const std::shared_ptr<const Topic>& topic, std::int64_t time, Bytes data);

	Stop stop_;
	std::vector<Piece> pieces_;
	std::size_t next_piece_ = 0;
	std::uint64_t file_size_ = 0;  //!< [byte]
	std::priority_queue<Waiting, std::vector<Waiting>, IsLater> waiting_;
	std::size_t loaded_ = 0;         //!< [-] messages
	std::size_t waiting_bytes_ = 0;  //!< [byte] of memory that the messages take which wait
	std::string damage_at_end_;      //!< told when all messages are through that were read
};

/// Says what a ROS recording is, by its content.
enum class RosFormat
{
	kBag1,    //!< ROS 1 bag
	kSqlite,  //!< ROS 2 bag, sqlite3
	kMcap,    //!< MCAP
	kFolder,  //!< a folder with the metadata.yaml of a ROS 2 bag, or with files .mcap, .db3 or .bag
};

/// Returns the format of a file, or no value if it is no recording.
/// \param start first bytes of the file
std::optional<RosFormat> recognize_ros(Bytes start);

/// Returns the format of a file or a folder, or no value if it is no recording.
/// \throws LogError if it cannot be read
std::optional<RosFormat> recognize_ros(const std::string& path);

/// Opens a recording from its start.
/// \param with_clouds whether its point clouds are read, too
/// \param stop is asked a few times a second or more often, here and by the source
/// \throws LogError, Interrupted if `stop` said so
std::unique_ptr<MessageSource> open_messages(
    const std::string& path, RosFormat format, const Stop& stop = [] { return false; }, bool with_clouds = false);

/// Returns the files of a folder that ROS recorded, in the order of their times.
/// \throws LogError, Interrupted if `stop` said so
std::vector<std::string> files_of_folder(const std::string& folder, const Stop& stop);

/// Opens such files, one after the other. \throws as open_messages()
std::unique_ptr<MessageSource> open_files(const std::vector<std::string>& files, const Stop& stop, bool with_clouds);

/// Returns what is said of a file that was packed as a whole, by what it is when it is unpacked; empty if it is none.
/// \param start first bytes of the file
std::string describe_packed(const std::string& start, const std::string& unpacked_start);

/// Returns the files .mcap, .db3 or .bag of a folder, in the order of the numbers in their names.
/// \throws LogError if it has files of two kinds, or only packed ones
std::vector<std::string> files_of_bag(const std::string& folder);

// The formats, each in a file of its own. \throws as open_messages()
std::unique_ptr<MessageSource> open_bag1(const std::string& path, const Stop& stop, bool with_clouds);
std::unique_ptr<MessageSource> open_sqlite(const std::string& path, const Stop& stop, bool with_clouds);
std::unique_ptr<MessageSource> open_mcap(const std::string& path, const Stop& stop, bool with_clouds);
}  // namespace d2s1r::logs
