// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "logs/log.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/core/format.h>
#include <mrpt/system/datetime.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <deque>
#include <filesystem>
#include <new>

#include "formats.h"
#include "logs/errors.h"
#include "unpacking_stream.h"

namespace d2s1r::logs
{
namespace
{
namespace fs = std::filesystem;

void check_is_there(const std::string& path)
{
	std::error_code error;
	if (!fs::exists(path, error))
		throw LogError(
		    path, (error ? "cannot be reached (" + error.message() + ")" : "no such log") + "; check the path");
	if (fs::is_directory(path, error))
	{
		if (fs::exists(fs::path(path) / "metadata.yaml", error) || !files_of_bag(path).empty()) return;
		throw LogError(
		    path, "is a folder without metadata.yaml and without files .mcap, .db3 or .bag; name the file of the log");
	}
	if (!fs::is_regular_file(path, error))
		throw LogError(path, "is a device or a pipe, but is read twice; copy the log to a regular file");
	if (fs::file_size(path, error) == 0) throw LogError(path, "is empty; copy or record the log again");
}

/// Returns whether a file starts with an object as MRPT serializes it: the length of the name of its class, and the
/// name.
bool is_rawlog(const std::string& start)
{
	constexpr unsigned kLengthFollows = 0x80;
	if (start.empty()) return false;
	const auto first = static_cast<unsigned char>(start[0]);
	const std::string name = start.substr(1, first & ~kLengthFollows);
	return (first & kLengthFollows) != 0 && name.size() > 1 &&
	       std::all_of(
	           name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_' || c == ':'; });
}

/// The start of a file, unpacked; empty if it is packed and damaged.
std::string unpacked_start(const std::string& path)
{
	constexpr std::size_t kSize = 4096;  // [byte] of text in which a message of CARMEN must appear
	try
	{
		return read_unpacked_start(path, kSize);
	}
	catch (const LogError&)
	{
		throw;
	}
	catch (const ReadError& e)
	{
		throw LogError(path, unread("", e.what()));
	}
	catch (const Unreadable& e)
	{
		throw LogError(path, e.what());
	}
	catch (const std::bad_alloc&)
	{
		throw;
	}
	catch (const std::exception&)
	{
		return "";
	}
}

class OverridingReader : public LogReader
{
   public:
	OverridingReader(std::unique_ptr<LogReader> reader, std::string label, Overrides overrides)
	    : reader_(std::move(reader)), label_(std::move(label)), overrides_(std::move(overrides))
	{
	}

	std::optional<RawlogObject> next() override
	{
		auto object = reader_->next();
		damage_ = reader_->damage();
		missing_class_ = reader_->missing_class();
		if (!object) return std::nullopt;
		alter_odometry(*object);
		for (std::size_t i = 0; i < object->scans.size(); i++)
		{
			const std::string& label = object->scans[i]->label;
			const auto of_other = overrides_.of_others.find(label);
			if (label != label_ && of_other == overrides_.of_others.end()) continue;
			const ros::Overrides& of_laser = label == label_ ? overrides_ : of_other->second;
			apply(of_laser, *object->scans[i]);
			alter(of_laser, object->details[i]);
			object->bytes.clear();  // which are no longer those of the object
		}
		return object;
	}

   private:
	void alter_odometry(RawlogObject& object) const
	{
		if (object.odometry_time > 0) object.odometry_time -= std::llround(1e9 * overrides_.odometry_clock);
		for (auto* pose : {&object.odometry, &object.increment})
			if (*pose) *pose = ros::odometry_as(overrides_, **pose);
	}

	static void alter(const ros::Overrides& of_laser, ScanDetails& details)
	{
		if (is_answered(details.unusable, of_laser)) details.unusable = {};
		if (of_laser.sweep) details.sweep = *of_laser.sweep;
	}

	std::unique_ptr<LogReader> reader_;
	std::string label_;
	Overrides overrides_;
};

/// Reads a log, and gives each scan the odometry at its time and during its beams. Unless the log is still being
/// written, an object is held back until the odometry after its scans has come, or the log has gone on for half a
/// second, or what waits takes more than ros::kMostBytesWaiting.
class ReaderWithOdometry : public LogReader
{
   public:
	ReaderWithOdometry(std::unique_ptr<LogReader> reader, const LogSurvey& survey, std::string label)
	    : reader_(std::move(reader)), waits_(!survey.is_live && !survey.odometry.empty()), label_(std::move(label))
	{
	}

	std::optional<RawlogObject> next() override
	{
		while (waiting_.empty() || must_wait(waiting_.front()))
			if (!read()) break;
		if (waiting_.empty())
		{
			damage_ = reader_->damage();
			missing_class_ = reader_->missing_class();
			return std::nullopt;
		}
		RawlogObject object = std::move(waiting_.front().object);
		waiting_.pop_front();
		bytes_ -= weight_of(object);
		for (std::size_t i = 0; i < object.scans.size(); i++) complete(*object.scans[i], object.details[i]);
		return object;
	}

	const ros::RobotTrack* track() const override { return &track_; }

   private:
	struct Waiting
	{
		RawlogObject object;
		ros::Time since = 0;
	};

	/// Returns whether there was another object.
	bool read()
	{
		if (is_at_end_) return false;
		auto object = reader_->next();
		is_at_end_ = !object;
		if (!object) return false;
		take_odometry(*object);
		for (std::size_t i = 0; i < object->scans.size(); i++)
		{
			ScanDetails& details = object->details[i];
			if (details.time == 0) details.time = ros::from_time(object->scans[i]->timestamp);
			details.sweep = details.time > 0 ? details.sweep.checked() : SweepTime();
			now_ = std::max(now_, details.time);
			if (has_increments_) track_.add(ros::OdometrySource::kMessages, details.time, newest_);
			if (is_news_ && (is_by_order_ || details.time == 0)) details.robot = newest_;
		}
		if (!object->scans.empty()) is_news_ = false;
		if (!object->is_of_log()) return true;
		bytes_ += weight_of(*object);
		waiting_.push_back({std::move(*object), now_});
		return true;
	}

	void take_odometry(const RawlogObject& object)
	{
		if (object.odometry && object.odometry_time > 0)
			track_.add(object.odometry_source, object.odometry_time, *object.odometry);
		now_ = std::max(now_, object.odometry_time);
		has_increments_ = has_increments_ || object.increment;
		// What stands in one sensory frame belongs together, whatever its stamps say.
		const bool has_no_time = object.odometry_time == 0 || !object.scans.empty();
		is_by_order_ = is_by_order_ || object.increment || (object.odometry && has_no_time);
		is_news_ = is_news_ || object.odometry || object.increment;
		if (object.odometry) newest_ = *object.odometry;
		if (object.increment) newest_ = newest_ + *object.increment;
	}

	bool must_wait(const Waiting& waiting) const
	{
		if (!waits_ || bytes_ > ros::kMostBytesWaiting) return false;
		const auto& details = waiting.object.details;
		return std::any_of(
		    details.begin(), details.end(),
		    [&](const ScanDetails& scan)
		    {
			    const auto end = scan.time + static_cast<ros::Time>(1e9 * scan.sweep.span().second);
			    return scan.time > 0 && track_.must_wait(end, now_ - waiting.since);
		    });
	}

	/// Gives a scan the odometry at its time and over its sweep.
	void complete(const RecordedScan& scan, ScanDetails& details)
	{
		if (scan.label == label_ && details.time > 0 && details.unusable.text.empty()) track_.judge(details.time, scan);
		details.motion = track_.sweep_of(details.sweep, details.time, scan.size());
		if (!details.robot && details.time > 0) details.robot = track_.at(details.time);
	}

	std::unique_ptr<LogReader> reader_;
	bool waits_;
	std::string label_;
	std::deque<Waiting> waiting_;
	std::size_t bytes_ = 0;  //!< of these
	ros::RobotTrack track_;
	ros::Time now_ = 0;            //!< newest of all that has been read
	mrpt::poses::CPose2D newest_;  //!< by the last reading, whatever its time
	bool is_news_ = false;         //!< whether that came after the last scan
	bool has_increments_ = false;  //!< of action collections, which end at the next scan
	bool is_by_order_ = false;     //!< whether the order of the log tells to which scan a reading belongs
	bool is_at_end_ = false;
};

constexpr double kTicksPerSecond = mrpt::Clock::period::den;  //!< [1/s] a tick is 100 ns
constexpr double kFirstTime = -1e10;                          //!< [s] in 1653; MRPT's clock starts in 1601
constexpr double kLastTime = 1e11;                            //!< [s] in 5138
}  // namespace

std::string unread(const std::string& where, const std::string& reason)
{
	return "cannot be read" + (where.empty() ? "" : " " + where) + " (" + reason +
	       "); check the disk or the connection, or copy the log again";
}

LogError cannot_open(const std::string& file)
{
	if (errno == 0 || errno == ENOMEM) throw std::bad_alloc();  // zlib leaves errno alone when memory runs out
	const char* const advice = advice_on(errno, "check the file and the disk");
	return LogError(file, std::string("cannot be opened (") + std::strerror(errno) + "); " + advice);
}

double to_seconds(mrpt::Clock::time_point time)
{
	if (time == INVALID_TIMESTAMP) return 0;
	// A damaged log may hold any number, so that the difference may be out of range: unsigned numbers wrap around.
	const auto ticks = static_cast<std::uint64_t>(time.time_since_epoch().count());
	const auto epoch = static_cast<std::uint64_t>(mrpt::Clock::fromDouble(0).time_since_epoch().count());
	return static_cast<double>(static_cast<std::int64_t>(ticks - epoch)) / kTicksPerSecond;
}

mrpt::Clock::time_point from_seconds(double seconds)
{
	const double held = std::clamp(seconds, kFirstTime, kLastTime);
	return mrpt::Clock::fromDouble(0) + mrpt::Clock::duration(std::llround(held * kTicksPerSecond));
}

void apply(const ros::Overrides& overrides, RecordedScan& scan)
{
	ros::apply(overrides, scan.middle_angle, scan);
	if (const auto& angles = overrides.beam_angles) scan.middle_angle = 0.5 * (angles->first + angles->last);
}

RawlogObject object_of(RecordedScan scan)
{
	RawlogObject object;
	object.scans.push_back(std::make_shared<RecordedScan>(std::move(scan)));
	object.details.emplace_back();
	return object;
}

RawlogObject object_of(OdometryReading reading)
{
	RawlogObject object;
	if (std::isfinite(reading.pose.norm() + reading.pose.phi()))
	{
		object.odometry = reading.pose;
		object.odometry_time = ros::from_time(reading.timestamp);
	}
	object.reading = std::move(reading);
	return object;
}

std::size_t weight_of(const RawlogObject& object)
{
	std::size_t bytes = sizeof object + object.bytes.size();
	for (const auto& scan : object.scans) bytes += ros::weight_of(scan->size());
	return bytes;
}

#ifndef D2S1R_TF2
[[noreturn]] void refuse_ros(const std::string& path)
{
	throw LogError(
	    path, "is a recording of ROS, which this program was built without; install libtf2-dev and build it again");
}

Log open_ros_log(
    const std::string& path, RosFormat /*format*/, const Stop& /*stop*/,
    const std::optional<ros::HeightBand>& /*cloud_height*/)
{
	refuse_ros(path);
}

PosesInFrame read_poses_of_topic(const std::string& path, const std::string&, const std::string&)
{
	refuse_ros(path);
}

PosesInFrame read_poses_of_frame(const std::string& path, const std::string&, const std::string&, const std::string&)
{
	refuse_ros(path);
}
#endif

namespace
{
std::string folder_of(const std::string& path)
{
	const std::string folder = fs::path(path).parent_path().string();
	return folder.empty() ? "." : folder;
}
}  // namespace

Log open_log(
    const std::string& path, const Stop& stop, const Labels& left_out,
    const std::optional<ros::HeightBand>& cloud_height)
{
	check_is_there(path);
	if (fs::is_directory(path)) return open_ros_log(path, RosFormat::kFolder, stop, cloud_height);
	const std::string magic = first_bytes(path);
	const auto ros = recognize_ros({reinterpret_cast<const std::uint8_t*>(magic.data()), magic.size()});
	if (ros) return open_ros_log(path, *ros, stop, cloud_height);
	const std::string start = unpacked_start(path);
	if (is_carmen_text(start)) return open_carmen_log(path, stop);
	const bool is_cut_gzip = start.size() < 2 && magic.rfind("\x1f\x8b", 0) == 0;
	if (is_rawlog(start) || is_cut_gzip) return open_rawlog(path, stop, left_out);
	if (fs::path(path).filename() == "metadata.yaml")
		throw LogError(path, "describes the bag in its folder; name the folder, " + folder_of(path));
	const std::string packed = describe_packed(magic, start);
	if (!packed.empty()) throw LogError(path, packed);
	throw LogError(
	    path,
	    "not a log that I know (" + known_formats() + "); check that it is the right file and whole, and not packed");
}

bool is_log(const std::string& path)
try
{
	std::error_code error;
	if (fs::is_directory(path, error))
		return fs::exists(fs::path(path) / "metadata.yaml") || !files_of_bag(path).empty();
	if (!fs::is_regular_file(path, error)) return false;
	const std::string magic = first_bytes(path), start = unpacked_start(path);
	if (recognize_ros({reinterpret_cast<const std::uint8_t*>(magic.data()), magic.size()}) || is_carmen_text(start))
		return true;
	constexpr std::size_t kLongestName = 60;  // [byte] of the class of the first object, which a map has, too
	const std::string name = start.substr(0, kLongestName);
	const auto holds = [&](const char* part) { return name.find(part) != std::string::npos; };
	// MRPT's names of classes had no namespaces before version 1.3.
	return is_rawlog(start) && (holds("obs::C") || holds("CObservation") || holds("CSensoryFrame") || holds("CAction"));
}
catch (const std::bad_alloc&)
{
	throw;
}
catch (const std::exception&)
{
	return false;
}

std::string known_formats()
{
	std::string formats = kReadsRawlogs ? "MRPT rawlogs, CARMEN logs" : "CARMEN logs";
#ifdef D2S1R_TF2
	formats += ", ROS 1 bags";
#ifdef D2S1R_SQLITE
	formats += ", ROS 2 bags in sqlite3";
#endif
	formats += ", ROS 2 bags in MCAP";
#endif
	std::string packed;
#ifdef D2S1R_BZ2
	packed += ", bz2";
#endif
#ifdef D2S1R_LZ4
	packed += ", lz4";
#endif
#ifdef D2S1R_ZSTD
	packed += ", zstd";
#endif
	return formats + "; packed by gzip" + packed;
}

bool is_answered(const ScanDoubt& doubt, const ros::Overrides& overrides)
{
	switch (doubt.field)
	{
		case ScanDoubt::Field::kAngles:
			return overrides.beam_angles.has_value();
		case ScanDoubt::Field::kLaserPose:
			return overrides.sensor_pose.has_value();
		case ScanDoubt::Field::kMaxRange:
			return overrides.max_range.has_value();
		case ScanDoubt::Field::kSweep:
			return overrides.sweep.has_value();
		case ScanDoubt::Field::kNone:
			break;
	}
	return false;
}

std::unique_ptr<LogReader> read_log(const Log& log, const std::string& label, const Overrides& overrides)
{
	auto reader = log.read_for(label);
	if (!ros::entries_of(overrides).empty() || !overrides.of_others.empty())
		reader = std::make_unique<OverridingReader>(std::move(reader), label, overrides);
	return std::make_unique<ReaderWithOdometry>(std::move(reader), log.survey, label);
}
}  // namespace d2s1r::logs
