// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/messages.h"

#include <base/errors.h>
#include <mrpt/poses/CPose2D.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace d2s1r::ros
{
namespace
{
/// Fields as ROS 1 writes them, without gaps, or as ROS 2 does: plain CDR of version 1 or 2 (OMG
/// DDS-XTypes 1.3, 7.4.3), whose numbers stand at multiples of their size, in version 2 of 4 bytes at most. Own code,
/// since Debian's Fast CDR 1.0 reads version 1 only.
class Fields
{
   public:
	explicit Fields(const EncodedMessage& message)
	    : cursor_(message.data), is_of_ros1_(message.encoding == Encoding::kRos1)
	{
		if (!is_of_ros1_) read_encapsulation();
		size_ = cursor_.left();
	}

	bool are_of_ros1() const { return is_of_ros1_; }

	template <typename Number>
	Number number()
	{
		align(sizeof(Number));
		auto value = cursor_.number<Number>();
		if (swaps_) swap_bytes(&value, 1);
		return value;
	}

	/// A text after its length, which counts the zero behind it in CDR.
	std::string text()
	{
		const Bytes bytes = cursor_.take(number<std::uint32_t>());
		return {reinterpret_cast<const char*>(bytes.data), bytes.size - (!is_of_ros1_ && bytes.size > 0 ? 1 : 0)};
	}

	Bytes take(std::size_t size) { return cursor_.take(size); }
	std::size_t left() const { return cursor_.left(); }

	void copy_to(std::vector<float>& numbers)
	{
		if (numbers.empty()) return;
		align(sizeof(float));
		const std::size_t size = numbers.size() * sizeof(float);
		std::memcpy(numbers.data(), cursor_.take(size).data, size);
		if (swaps_) swap_bytes(numbers.data(), numbers.size());
	}

   private:
	void read_encapsulation()
	{
		constexpr std::size_t kHeadSize = 4;  // [byte]
		const Bytes head = cursor_.take(kHeadSize);
		const unsigned encoding = head.data[0] * 256U + head.data[1];
		const bool is_first = encoding <= 1, is_second = encoding == 6 || encoding == 7;
		if (!is_first && !is_second)
			throw Unreadable(
			    "holds messages in encoding " + std::to_string(encoding) +
			    " of DDS, but only plain CDR is read (0, 1, 6, 7), which ROS 2 writes; record the log by ROS 2");
		swaps_ = encoding % 2 == 0;  // big-endian
		most_alignment_ = is_second ? 4 : 8;
	}

	void align(std::size_t size)
	{
		const std::size_t alignment = std::min(size, most_alignment_), past = (size_ - cursor_.left()) % alignment;
		if (past != 0) cursor_.take(alignment - past);
	}

	template <typename Number>
	static void swap_bytes(Number* numbers, std::size_t count)
	{
		auto* bytes = reinterpret_cast<unsigned char*>(numbers);
		for (std::size_t i = 0; i < count; i++)
			std::reverse(bytes + i * sizeof(Number), bytes + (i + 1) * sizeof(Number));
	}

	ByteCursor cursor_;
	bool is_of_ros1_;
	std::size_t size_ = 0;            //!< [byte] of the fields
	std::size_t most_alignment_ = 1;  //!< [byte]
	bool swaps_ = false;
};

std::string without_slash(const std::string& frame)
{
	return frame.rfind('/', 0) == 0 ? frame.substr(1) : frame;
}

/// A count of elements that each take `least_size` bytes or more.
std::uint32_t count_of(Fields& fields, std::size_t least_size)
{
	const auto count = fields.number<std::uint32_t>();
	if (count > fields.left() / least_size) throw std::runtime_error("a message is shorter than it says");
	return count;
}

/// The name of a frame. \throws std::runtime_error if it is far longer than names are
std::string read_frame(Fields& fields)
{
	constexpr std::size_t kLongestName = 1000;  // [byte]
	const std::string frame = without_slash(fields.text());
	if (frame.size() > kLongestName) throw std::runtime_error("the name of a frame is longer than 1000 bytes");
	return frame;
}

/// A time [ns]; 0 if it is before the epoch, which only ROS 2 can write.
std::int64_t read_time(Fields& fields)
{
	const std::int64_t seconds = fields.are_of_ros1() ? std::int64_t{fields.number<std::uint32_t>()}
	                                                  : std::int64_t{fields.number<std::int32_t>()};
	const std::int64_t nanoseconds = fields.number<std::uint32_t>();
	return seconds >= 0 ? seconds * 1'000'000'000 + nanoseconds : 0;
}

Header read_header(Fields& fields)
{
	if (fields.are_of_ros1()) fields.number<std::uint32_t>();  // in its sequence
	const std::int64_t time = read_time(fields);
	return {time, read_frame(fields)};
}

std::optional<mrpt::poses::CPose3D> read_pose(Fields& fields)
{
	double values[7];  // x y z [m], then a quaternion x y z w
	for (double& value : values) value = fields.number<double>();
	const auto& [x, y, z, qx, qy, qz, qw] = values;
	const double norm = std::sqrt(qx * qx + qy * qy + qz * qz + qw * qw);
	if (!std::isfinite(norm + x + y + z) || !(norm > 0.1)) return std::nullopt;
	return mrpt::poses::CPose3D(mrpt::math::CQuaternionDouble(qw / norm, qx / norm, qy / norm, qz / norm), x, y, z);
}

LaserScan read_geometry(Fields& fields)
{
	LaserScan scan;
	scan.header = read_header(fields);
	scan.first_angle = fields.number<float>();
	scan.last_angle = fields.number<float>();
	scan.angle_step = fields.number<float>();
	scan.time_step = fields.number<float>();
	scan.scan_time = fields.number<float>();
	scan.min_range = fields.number<float>();
	scan.max_range = fields.number<float>();
	return scan;
}

struct CloudLayout
{
	std::size_t rows = 0, columns = 0;         //!< [-] of points
	std::array<std::size_t, 3> offsets{};      //!< [byte] of x, y, z in a point
	std::array<bool, 3> are_double{};          //!< whether they are float64, else float32
	std::optional<std::size_t> time_offset{};  //!< [byte] of its time in a point
	std::uint8_t time_type = 0;                //!< of this
	std::size_t point_size = 0, row_size = 0;  //!< [byte]
	bool is_big_endian = false;
};

constexpr std::uint8_t kUint32 = 6, kFloat32 = 7, kFloat64 = 8;  // types of fields

bool is_name_of_time(const std::string& name)
{
	return name == "t" || name == "time" || name == "timestamp" || name == "time_stamp" || name == "offset_time" ||
	       name == "time_offset";
}

/// Reads the descriptions of a point's fields, of which x, y and z are kept.
void read_coordinates(Fields& fields, CloudLayout& layout)
{
	constexpr std::size_t kLeastSize = 13;  // [byte] of the description of a field
	std::array<bool, 3> found{};
	for (std::uint32_t left = count_of(fields, kLeastSize); left > 0; left--)
	{
		const std::string name = fields.text();
		const auto offset = fields.number<std::uint32_t>();
		const auto type = fields.number<std::uint8_t>();
		const auto count = fields.number<std::uint32_t>();  // some drivers write 0 for 1
		if (is_name_of_time(name) && count <= 1 && type >= kUint32 && type <= kFloat64)
		{
			layout.time_offset = offset;
			layout.time_type = type;
		}
		if (name.size() != 1 || name[0] < 'x' || name[0] > 'z') continue;
		const auto axis = static_cast<std::size_t>(name[0] - 'x');
		if (found[axis] || count > 1 || (type != kFloat32 && type != kFloat64))
			throw Unreadable("holds point clouds whose " + name + " is not one float32 or float64; convert them");
		found[axis] = true;
		layout.offsets[axis] = offset;
		layout.are_double[axis] = type == kFloat64;
	}
	if (!found[0] || !found[1] || !found[2])
		throw Unreadable("holds point clouds without fields x, y and z; convert them");
}

CloudLayout read_layout(Fields& fields)
{
	CloudLayout layout;
	layout.rows = fields.number<std::uint32_t>();
	layout.columns = fields.number<std::uint32_t>();
	read_coordinates(fields, layout);
	layout.is_big_endian = fields.number<std::uint8_t>() != 0;
	layout.point_size = fields.number<std::uint32_t>();
	layout.row_size = fields.number<std::uint32_t>();
	const std::size_t least = layout.columns * layout.point_size;
	if (layout.rows == 1) layout.row_size = least;  // which some drivers do not fill in
	for (std::size_t axis = 0; axis < 3; axis++)
		if (layout.offsets[axis] + (layout.are_double[axis] ? 8 : 4) > layout.point_size)
			throw std::runtime_error("the point_step of a point cloud is shorter than its fields");
	if (layout.time_offset && *layout.time_offset + (layout.time_type == kFloat64 ? 8 : 4) > layout.point_size)
		throw std::runtime_error("the point_step of a point cloud is shorter than its fields");
	if (layout.row_size < least) throw std::runtime_error("the row_step of a point cloud is shorter than its points");
	return layout;
}

/// Returns the number that begins at `bytes`, in the byte order of the cloud.
template <typename Number>
Number number_at(const std::uint8_t* bytes, const CloudLayout& layout)
{
	std::array<std::uint8_t, sizeof(Number)> copy{};
	std::memcpy(copy.data(), bytes, copy.size());
	if (layout.is_big_endian) std::reverse(copy.begin(), copy.end());
	Number number;
	std::memcpy(&number, copy.data(), sizeof number);
	return number;
}

/// Returns a coordinate of the point that begins at `point`.
float coordinate_at(const std::uint8_t* point, std::size_t axis, const CloudLayout& layout)
{
	if (!layout.are_double[axis]) return number_at<float>(point + layout.offsets[axis], layout);
	const auto value = number_at<double>(point + layout.offsets[axis], layout);
	constexpr double kGreatest = std::numeric_limits<float>::max();
	return std::abs(value) <= kGreatest ? static_cast<float>(value) : std::numeric_limits<float>::quiet_NaN();
}

/// Returns the time of the point that begins at `point`, as its driver wrote it; 0 if the points have none.
double time_at(const std::uint8_t* point, const CloudLayout& layout)
{
	if (!layout.time_offset) return 0;
	const std::uint8_t* const at = point + *layout.time_offset;
	if (layout.time_type == kUint32) return static_cast<double>(number_at<std::uint32_t>(at, layout));
	if (layout.time_type == kFloat32) return static_cast<double>(number_at<float>(at, layout));
	return number_at<double>(at, layout);
}

/// Turns the times of the points of a cloud, as its driver wrote them, into times [s] after that of the message.
/// Drivers count since the epoch of the message, or since the message: in ns as a rule if these are whole numbers, in s
/// if they are not. If the cloud cannot have taken as long as that says, they are in the unit by which it may have.
/// \param message [ns]
void to_seconds_after(std::int64_t message, const CloudLayout& layout, std::vector<double>& times)
{
	constexpr double kLatest = 10, kShortestCloud = 1e-3,
	                 kLongestCloud = 0.5;                // [s] after the message; of a whole cloud
	constexpr std::array kUnits{1.0, 1e-3, 1e-6, 1e-9};  // [s]
	double least = HUGE_VAL, greatest = -HUGE_VAL;
	for (const double time : times)
		if (std::isfinite(time)) least = std::min(least, time), greatest = std::max(greatest, time);
	const double stamp = kUnits.back() * static_cast<double>(message);
	const auto is_absolute = [&](double unit)
	{ return unit * greatest > kLatest && std::abs(unit * greatest - stamp) < kLatest; };
	const auto may_last = [&](double unit)
	{ return unit * (greatest - least) >= kShortestCloud && unit * (greatest - least) <= kLongestCloud; };
	const auto absolute = std::find_if(kUnits.begin(), kUnits.end(), is_absolute);
	const bool since_message = absolute == kUnits.end();
	double unit = since_message ? (layout.time_type == kUint32 ? kUnits.back() : kUnits.front()) : *absolute;
	if (since_message && !may_last(unit))
		if (const auto other = std::find_if(kUnits.begin(), kUnits.end(), may_last); other != kUnits.end())
			unit = *other;
	for (double& time : times)
	{
		time = unit * time - (since_message ? 0 : stamp);
		if (!(std::abs(time) <= kLatest)) time = 0;  // it is not known
	}
}
}  // namespace

Header decode_header(const EncodedMessage& message)
{
	Fields fields(message);
	return read_header(fields);
}

LaserScan decode_laser_scan(const EncodedMessage& message)
{
	Fields fields(message);
	LaserScan scan = read_geometry(fields);
	scan.ranges.resize(count_of(fields, sizeof(float)));
	fields.copy_to(scan.ranges);
	return scan;
}

LaserScan decode_multi_echo_scan(const EncodedMessage& message)
{
	Fields fields(message);
	LaserScan scan = read_geometry(fields);
	scan.ranges.resize(count_of(fields, sizeof(std::uint32_t)));
	std::vector<float> echoes;
	for (float& range : scan.ranges)
	{
		echoes.resize(count_of(fields, sizeof(float)));
		fields.copy_to(echoes);
		range = echoes.empty() ? std::numeric_limits<float>::quiet_NaN() : echoes.front();
	}
	return scan;
}

PointCloud decode_point_cloud(const EncodedMessage& message)
{
	Fields fields(message);
	PointCloud cloud;
	cloud.header = read_header(fields);
	const CloudLayout layout = read_layout(fields);
	const Bytes data = fields.take(count_of(fields, 1));
	if (layout.rows == 0 || layout.columns == 0) return cloud;
	const std::size_t last_row = layout.columns * layout.point_size;
	if (data.size < last_row || layout.rows - 1 > (data.size - last_row) / layout.row_size)
		throw std::runtime_error("a point cloud has less data than it says");
	cloud.points.reserve(layout.rows * layout.columns);
	std::vector<double> times;
	times.reserve(layout.rows * layout.columns);
	for (std::size_t row = 0; row < layout.rows; row++)
		for (std::size_t column = 0; column < layout.columns; column++)
		{
			const std::uint8_t* const point = data.data + row * layout.row_size + column * layout.point_size;
			cloud.points.push_back(
			    {coordinate_at(point, 0, layout), coordinate_at(point, 1, layout), coordinate_at(point, 2, layout)});
			times.push_back(time_at(point, layout));
		}
	to_seconds_after(cloud.header.time, layout, times);
	for (std::size_t i = 0; i < times.size(); i++) cloud.points[i].time = static_cast<float>(times[i]);
	return cloud;
}

Odometry decode_odometry(const EncodedMessage& message)
{
	Fields fields(message);
	constexpr int kCovarianceSize = 36;
	Odometry odometry;
	odometry.pose.header = read_header(fields);
	odometry.pose.child = read_frame(fields);
	odometry.pose.pose = read_pose(fields);
	for (int i = 0; i < kCovarianceSize; i++) fields.number<double>();
	double twist[6];  // x y z [m/s], then about these axes [rad/s]
	for (double& value : twist) value = fields.number<double>();
	odometry.velocity = {twist[0], twist[1], twist[5]};
	return odometry;
}

StampedPose decode_stamped_pose(const EncodedMessage& message)
{
	Fields fields(message);
	StampedPose pose;
	pose.header = read_header(fields);
	pose.pose = read_pose(fields);
	return pose;
}

std::vector<Transform> decode_transforms(const EncodedMessage& message)
{
	Fields fields(message);
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

OccupancyGrid decode_occupancy_grid(const EncodedMessage& message)
{
	Fields fields(message);
	constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
	OccupancyGrid grid;
	grid.header = read_header(fields);
	read_time(fields);  // when it was loaded
	grid.resolution = static_cast<double>(fields.number<float>());
	grid.width = fields.number<std::uint32_t>();
	grid.height = fields.number<std::uint32_t>();
	const auto origin = read_pose(fields);
	grid.origin = origin ? mrpt::poses::CPose2D(*origin).asTPose() : mrpt::math::TPose2D(kNone, kNone, kNone);
	const Bytes cells = fields.take(count_of(fields, 1));
	grid.percent.assign(cells.data, cells.data + cells.size);
	return grid;
}

Time decode_clock(const EncodedMessage& message)
{
	Fields fields(message);
	return read_time(fields);
}
}  // namespace d2s1r::ros
