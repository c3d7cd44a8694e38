// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Logs of robots, written by the rules of their formats and without the code that reads them.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace d2s1r::test
{
/// How the fields of a message are written.
enum class Wire
{
	kRos1,
	kCdr,       //!< little-endian
	kCdr2,      //!< the same of version 2
	kBigEndian  //!< CDR
};

/// Fields of a message, one after the other.
class FieldWriter
{
   public:
	explicit FieldWriter(Wire wire);

	template <typename Number>
	FieldWriter& number(Number value)
	{
		align(sizeof value);
		std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
		if (wire_ == Wire::kBigEndian) std::reverse(bytes.begin(), bytes.end());
		bytes_ += bytes;
		return *this;
	}
	FieldWriter& text(const std::string& text);
	FieldWriter& header(std::int64_t nanoseconds, const std::string& frame);

	const std::string& bytes() const { return bytes_; }

   private:
	void align(std::size_t size);

	Wire wire_;
	std::string bytes_;
};

struct MadeScan
{
	std::int64_t time = 0;  //!< [ns]
	std::string frame = "laser";
	float first_angle = -1.5F;  //!< [rad]
	float angle_step = 0.5F;    //!< [rad]
	float time_step = 0;        //!< [s] from beam to beam
	float scan_time = 0;        //!< [s] from scan to scan
	float min_range = 0.1F;     //!< [m]
	float max_range = 10.0F;    //!< [m]
	std::vector<float> ranges = {1, 2, 3, 4, 5, 6, 7};
	std::optional<float> last_angle{};  //!< [rad] angle_max; without a value, as the others make it
};
std::string scan_message(Wire wire, const MadeScan& scan);

/// A sensor_msgs/PointCloud2, and what it says wrongly.
struct MadeCloud
{
	std::int64_t time = 0;  //!< [ns]
	std::string frame = "laser";
	std::vector<std::array<double, 3>> points = {{1, 2, 3}, {-4, 5, 0.5}};  //!< [m]
	std::uint32_t rows = 1;
	std::uint32_t row_gap = 0;  //!< [byte] after each row
	bool is_big_endian = false;
	bool are_double = false;
	std::vector<std::string> fields = {"x", "y", "z"};
	std::uint32_t field_count = 1;
	std::uint8_t field_type = 0;     //!< 0: the right one
	std::uint32_t point_step = 0;    //!< [byte] 0: the right one
	std::uint32_t missing_data = 0;  //!< [byte] that are cut off the data
	std::string time_field{};        //!< name of the field with the times; empty: there is none
	std::uint8_t time_type = 7;      //!< of this field: 6 uint32, 7 float32, 8 float64
	std::vector<double> times{};     //!< of the points, in the unit of the field
};
std::string cloud_message(Wire wire, const MadeCloud& cloud);

std::string odometry_message(Wire wire, std::int64_t time, const std::string& child, double x, double y, double phi);

/// A pose by its position [m] and a rotation about one axis, 'x', 'y' or 'z' [rad].
struct MadeTransform
{
	std::string parent, child;
	double x = 0, y = 0, z = 0;
	char axis = 'z';
	double angle = 0;
};
std::string transform_message(Wire wire, std::int64_t time, const std::vector<MadeTransform>& transforms);

struct MadeMessage
{
	std::string topic;
	std::string type;
	std::int64_t time = 0;  //!< [ns] of its recording
	std::string data;
};
MadeMessage made_scan(Wire wire, const MadeScan& scan, const std::string& topic = "/scan");
MadeMessage made_cloud(Wire wire, const MadeCloud& cloud, const std::string& topic = "/points");
MadeMessage made_odometry(Wire wire, std::int64_t time, double x, double y, double phi);
/// geometry_msgs/PoseWithCovarianceStamped of /amcl_pose, or PoseStamped of /pose.
MadeMessage made_pose(Wire wire, bool has_covariance, std::int64_t time, double x, double y, double phi);
MadeMessage made_transforms(
    Wire wire, std::int64_t time, const std::vector<MadeTransform>& transforms,
    const std::string& topic = "/tf_static");

/// How the messages of a file are put together.
struct Packing
{
	std::string method{};                    //!< "", "bz2", "lz4" or "zstd"
	std::size_t messages_in_chunk = 3;       //!< [-] 0: MCAP without chunks
	bool with_index = true;                  //!< of a chunk (ROS 1) or of the file (MCAP)
	std::vector<std::size_t> chunk_order{};  //!< empty: as the messages are
};
std::string bag1_file(const std::vector<MadeMessage>& messages, const Packing& packing = {});
std::string mcap_file(
    const std::vector<MadeMessage>& messages, const Packing& packing = {}, const std::string& encoding = "cdr");
void save_sqlite_bag(const std::string& path, const std::vector<MadeMessage>& messages);

/// Runs statements of SQL on a bag.
void alter_sqlite_bag(const std::string& path, const std::string& statements);

/// \param method "bz2", "lz4" (frames), "zstd" or, for a frame that does not tell its size, "zstd-stream"; else `bytes`
/// as they are
std::string packed(const std::string& method, const std::string& bytes);
bool can_pack(const std::string& method);
}  // namespace d2s1r::test
