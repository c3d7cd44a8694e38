// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/ros_messages.h"

#ifdef D2S1R_FASTCDR
#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/exceptions/Exception.h>
#endif

#include <algorithm>
#include <cmath>

namespace d2s1r::logs
{
namespace
{
/// Fields as ROS 1 writes them.
class Ros1Fields
{
   public:
	static constexpr bool kHasSequenceNumber = true;

	explicit Ros1Fields(Bytes data) : cursor_(data) {}

	template <typename Number>
	Number number()
	{
		return cursor_.number<Number>();
	}
	std::string text() { return cursor_.text(); }
	std::size_t left() const { return cursor_.left(); }

	void copy_to(std::vector<float>& numbers)
	{
		const std::size_t size = numbers.size() * sizeof(float);
		if (size > 0) std::memcpy(numbers.data(), cursor_.take(size).data, size);
	}

   private:
	ByteCursor cursor_;
};

#ifdef D2S1R_FASTCDR
#if __has_include(<fastcdr/CdrEncoding.hpp>)  // Fast CDR 2
constexpr auto kDdsCdr = eprosima::fastcdr::CdrVersion::DDS_CDR;
std::size_t bytes_read(const eprosima::fastcdr::Cdr& cdr)
{
	return cdr.get_serialized_data_length();
}
void read_all(eprosima::fastcdr::Cdr& cdr, std::vector<float>& to)
{
	cdr.deserialize_array(to.data(), to.size());
}
#else
constexpr auto kDdsCdr = eprosima::fastcdr::Cdr::DDS_CDR;
std::size_t bytes_read(const eprosima::fastcdr::Cdr& cdr)
{
	return cdr.getSerializedDataLength();
}
void read_all(eprosima::fastcdr::Cdr& cdr, std::vector<float>& to)
{
	cdr.deserializeArray(to.data(), to.size());
}
#endif

/// Fields as ROS 2 writes them.
class CdrFields
{
   public:
	static constexpr bool kHasSequenceNumber = false;

	explicit CdrFields(Bytes data)
	    : size_(data.size),
	      buffer_(const_cast<char*>(reinterpret_cast<const char*>(data.data)), data.size),  // which is only read
	      cdr_(buffer_, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, kDdsCdr)
	{
		constexpr std::uint8_t kMostKnown = 1;  // plain CDR, big-endian or little-endian
		if (data.size < 4 || data.data[0] != 0 || data.data[1] > kMostKnown)
			throw std::runtime_error("a message is not encoded as plain CDR");
		cdr_.read_encapsulation();
	}

	template <typename Number>
	Number number()
	{
		Number value{};
		cdr_ >> value;
		return value;
	}

	std::string text()
	{
		std::string value;
		cdr_ >> value;
		return value;
	}

	std::size_t left() const { return size_ - std::min(size_, bytes_read(cdr_)); }

	void copy_to(std::vector<float>& numbers) { read_all(cdr_, numbers); }

   private:
	std::size_t size_;
	eprosima::fastcdr::FastBuffer buffer_;
	eprosima::fastcdr::Cdr cdr_;
};
#endif

std::string without_slash(const std::string& frame)
{
	return frame.rfind('/', 0) == 0 ? frame.substr(1) : frame;
}

/// A count of elements that each take `least_size` bytes or more.
template <typename Fields>
std::uint32_t count_of(Fields& fields, std::size_t least_size)
{
	const auto count = fields.template number<std::uint32_t>();
	if (count > fields.left() / least_size) throw std::runtime_error("a message is shorter than it says");
	return count;
}

/// The name of a frame. \throws std::runtime_error if it is far longer than names are
template <typename Fields>
std::string read_frame(Fields& fields)
{
	constexpr std::size_t kLongest = 1000;  // [byte]
	const std::string frame = without_slash(fields.text());
	if (frame.size() > kLongest) throw std::runtime_error("the name of a frame is longer than 1000 bytes");
	return frame;
}

template <typename Fields>
Header read_header(Fields& fields)
{
	if (Fields::kHasSequenceNumber) fields.template number<std::uint32_t>();
	const std::int64_t seconds = fields.template number<std::uint32_t>();
	const std::int64_t nanoseconds = fields.template number<std::uint32_t>();
	return {seconds * 1'000'000'000 + nanoseconds, read_frame(fields)};
}

template <typename Fields>
std::optional<mrpt::poses::CPose3D> read_pose(Fields& fields)
{
	double values[7];  // x y z [m], then a quaternion x y z w
	for (double& value : values) value = fields.template number<double>();
	const auto& [x, y, z, qx, qy, qz, qw] = values;
	const double norm = std::sqrt(qx * qx + qy * qy + qz * qz + qw * qw);
	if (!std::isfinite(norm + x + y + z) || !(norm > 0.1)) return std::nullopt;
	return mrpt::poses::CPose3D(mrpt::math::CQuaternionDouble(qw / norm, qx / norm, qy / norm, qz / norm), x, y, z);
}

template <typename Fields>
LaserScan read_laser_scan(Fields& fields)
{
	LaserScan scan;
	scan.header = read_header(fields);
	scan.first_angle = fields.template number<float>();
	fields.template number<float>();  // the last angle, which may contradict the number of beams
	scan.angle_step = fields.template number<float>();
	fields.template number<float>();  // the time from beam to beam
	scan.scan_time = fields.template number<float>();
	scan.min_range = fields.template number<float>();
	scan.max_range = fields.template number<float>();
	scan.ranges.resize(count_of(fields, sizeof(float)));
	fields.copy_to(scan.ranges);
	return scan;
}

template <typename Fields>
OdometryMessage read_odometry(Fields& fields)
{
	constexpr int kCovarianceSize = 36;
	OdometryMessage odometry;
	odometry.pose.header = read_header(fields);
	odometry.pose.child = read_frame(fields);
	odometry.pose.pose = read_pose(fields);
	for (int i = 0; i < kCovarianceSize; i++) fields.template number<double>();
	double twist[6];  // x y z [m/s], then about these axes [rad/s]
	for (double& value : twist) value = fields.template number<double>();
	odometry.velocity = {twist[0], twist[1], twist[5]};
	return odometry;
}

template <typename Fields>
std::vector<Transform> read_transforms(Fields& fields)
{
	constexpr std::size_t kLeastSize = 72;  // [byte] of one with frames that have no name
	std::vector<Transform> transforms(count_of(fields, kLeastSize));
	for (Transform& transform : transforms)
	{
		transform.header = read_header(fields);
		transform.child = read_frame(fields);
		transform.pose = read_pose(fields);
	}
	return transforms;
}

/// Calls `read` with the fields of a message in its encoding.
template <typename Read>
auto decode(const Message& message, const Read& read)
{
	if (message.topic->encoding == Encoding::kRos1) return read(Ros1Fields(message.data));
#ifdef D2S1R_FASTCDR
	std::vector<std::uint8_t> unpacked;
	Bytes data = message.data;
	if (is_zstd_frame(data))  // by rosbag2's compression of messages
	{
		unpacked = unpack_zstd_frame(data);
		data = {unpacked.data(), unpacked.size()};
	}
	try
	{
		return read(CdrFields(data));
	}
	catch (const eprosima::fastcdr::exception::Exception&)
	{
		throw std::runtime_error("a message is shorter than it says");
	}
#else
	throw Unreadable(
	    "holds messages in CDR, which this program was built without; install libfastcdr-dev and build it again");
#endif
}
}  // namespace

LaserScan decode_laser_scan(const Message& message)
{
	return decode(message, [](auto&& fields) { return read_laser_scan(fields); });
}

OdometryMessage decode_odometry(const Message& message)
{
	return decode(message, [](auto&& fields) { return read_odometry(fields); });
}

std::vector<Transform> decode_transforms(const Message& message)
{
	return decode(message, [](auto&& fields) { return read_transforms(fields); });
}
}  // namespace d2s1r::logs
