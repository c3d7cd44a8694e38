// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "rawlog/rawlog_reader.h"

#include <base/own_process.h>
#include <mrpt/io/CStream.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/system/os.h>
#include <xxhash.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>

#include "logs/errors.h"
#include "logs/mrpt_objects.h"
#include "process_of_file.h"
#include "unpacking_stream.h"

namespace d2s1r::logs
{
const bool kReadsRawlogs = true;

namespace
{
/// Passes bytes on to MRPT's archive and keeps them. A read that comes short throws, because MRPT's archive would go on
/// with garbage.
class RecordingStream : public mrpt::io::CStream
{
   public:
	RecordingStream(InputStream& source, std::vector<std::uint8_t>& bytes) : source_(source), bytes_(bytes) {}

	std::size_t Write(const void*, std::size_t) override { throw std::logic_error("read-only stream"); }
	std::uint64_t Seek(std::int64_t, TSeekOrigin) override { throw std::logic_error("stream without positions"); }
	std::uint64_t getTotalBytesCount() const override { return std::numeric_limits<std::uint64_t>::max(); }
	std::uint64_t getPosition() const override { return 0; }

	std::size_t Read(void* buffer, std::size_t count) override
	{
		const std::size_t got = read(buffer, count);
		came_short_ = got != count;
		at_clean_end_ = came_short_ && got == 0 && bytes_.empty() && !is_cut_;
		if (came_short_) throw mrpt::serialization::CExceptionEOF("end of file");
		const auto* first = static_cast<const std::uint8_t*>(buffer);
		bytes_.insert(bytes_.end(), first, first + got);
		return got;
	}

	bool came_short() const { return came_short_; }
	bool at_clean_end() const { return at_clean_end_; }
	bool became_shorter() const { return became_shorter_; }
	const std::string& read_error() const { return read_error_; }  //!< empty if there was none

   private:
	/// Keeps why a read failed: MRPT makes another exception of it.
	std::size_t read(void* buffer, std::size_t count)
	{
		try
		{
			return source_.read(buffer, count);
		}
		catch (const ReadError& error)
		{
			read_error_ = error.what();
			throw;
		}
		catch (const BecameShorter&)
		{
			became_shorter_ = true;
			throw;
		}
		catch (const CutShort&)
		{
			is_cut_ = true;
			return 0;
		}
	}

	InputStream& source_;
	std::vector<std::uint8_t>& bytes_;
	bool came_short_ = false;
	bool at_clean_end_ = false;  //!< [-] the file ended before the first byte of the object
	bool is_cut_ = false;        //!< [-] packed data ended early
	bool became_shorter_ = false;
	std::string read_error_;
};

/// Takes the scan or the odometry that an observation is, if it is one.
/// \param odometer label of the first odometer, the only one that is read: each has a frame of its own
void read_observation(
    const mrpt::serialization::CSerializable::Ptr& observation, std::optional<std::string>& odometer,
    const Labels& left_out, RawlogObject& into)
{
	if (const auto scan = std::dynamic_pointer_cast<mrpt::obs::CObservation2DRangeScan>(observation))
	{
		constexpr std::size_t kLongestLabel = 1000;  // [-] letters; all labels of a log are kept
		if (scan->sensorLabel.size() > kLongestLabel)
			throw Unreadable(
			    "has a scan whose sensorLabel has " + std::to_string(scan->sensorLabel.size()) +
			    " letters; give it a shorter one");
		into.scans.push_back(std::make_shared<RecordedScan>(recorded_scan(scan)));
		into.details.emplace_back();
	}
	const auto reading = std::dynamic_pointer_cast<mrpt::obs::CObservationOdometry>(observation);
	if (!reading || !std::isfinite(reading->odometry.norm() + reading->odometry.phi())) return;
	if (left_out.count(reading->sensorLabel) > 0) return;
	if (!odometer) odometer = reading->sensorLabel;
	if (reading->sensorLabel != *odometer) return;
	into.odometry = reading->odometry;
	into.odometry_time = ros::from_time(reading->timestamp);
}

/// Returns whether an object is a pose or odometry with one of these labels.
bool is_left_out(const mrpt::serialization::CSerializable& object, const Labels& left_out)
{
	const auto* const pose = dynamic_cast<const mrpt::obs::CObservationRobotPose*>(&object);
	const auto* const odometry = dynamic_cast<const mrpt::obs::CObservationOdometry*>(&object);
	return (pose && left_out.count(pose->sensorLabel) > 0) || (odometry && left_out.count(odometry->sensorLabel) > 0);
}

void read_contents(
    const mrpt::serialization::CSerializable::Ptr& object, std::optional<std::string>& odometer, const Labels& left_out,
    RawlogObject& into)
{
	if (const auto actions = std::dynamic_pointer_cast<mrpt::obs::CActionCollection>(object))
	{
		const auto movement = actions->getBestMovementEstimation();
		if (movement) into.increment = movement->poseChange->getMeanVal();
	}
	if (const auto frame = std::dynamic_pointer_cast<mrpt::obs::CSensoryFrame>(object))
		for (const auto& observation : *frame) read_observation(observation, odometer, left_out, into);
	else
		read_observation(object, odometer, left_out, into);
}

/// Returns the class that MRPT says it does not know; empty if it says something else, or if that is no name.
std::string unknown_class(const std::exception& error)
{
	const std::string text = error.what(), before = "Stored object has class '";
	const auto found = text.find(before);
	if (found == std::string::npos) return "";
	const auto start = found + before.size();
	const std::string name = text.substr(start, text.find('\'', start) - start);
	const bool is_name = std::all_of(
	    name.begin(), name.end(),
	    [](unsigned char c) { return c < 0x80 && (std::isalnum(c) || c == '_' || c == ':'); });
	return is_name ? name : "";
}

/// Returns the version of an object that MRPT says it does not know; empty if it says something else.
std::string unknown_version(const std::exception& error)
{
	const std::string text = error.what(), before = "unknown serialization version number: '";
	const auto found = text.find(before);
	if (found == std::string::npos) return "";
	const std::string number = text.substr(found + before.size(), 3);
	return number.substr(0, number.find_first_not_of("0123456789"));
}

/// Tells whether the bytes of an object are still those that were surveyed.
struct ObjectSum
{
	std::uint64_t size = 0;  //!< [byte]
	std::uint64_t hash = 0;  //!< other bytes have another one, but for one case in 2^64
};

std::uint64_t hash_of(const std::vector<std::uint8_t>& bytes)
{
	return XXH3_64bits(bytes.data(), bytes.size());
}

/// A rawlog is surveyed in a process of its own, and what is in it arrives as records: a letter and what it is about.
enum SurveyRecord : char
{
	kSensorRecord = 'l',    //!< the label of a sensor, before its first scan
	kScanRecord = 's',      //!< the number of the sensor of a scan, in the order of these
	kOdometryRecord = 'o',  //!< nothing more
	kObjectRecord = 'n',    //!< the ObjectSum of an object that has been read as a whole
	kDamageRecord = 'd',    //!< RawlogReader::damage()
	kClassRecord = 'c'      //!< RawlogReader::missing_class()
};

template <typename Number>
std::string record_of(SurveyRecord kind, const Number& number)
{
	return std::string(1, kind).append(reinterpret_cast<const char*>(&number), sizeof number);
}

/// The labels are looked up here, within the limits on time and memory: a log may have as many as it has scans.
void tell_contents(RawlogReader& reader, const Send& send)
{
	std::map<std::string, std::size_t> sensors;  // their numbers by label
	while (const auto object = reader.read())
	{
		for (const auto& scan : object->scans)
		{
			const auto [sensor, is_new] = sensors.emplace(scan->label, sensors.size());
			if (is_new) send(char{kSensorRecord} + sensor->first);
			send(record_of(kScanRecord, sensor->second));
		}
		if (object->odometry || object->increment) send({kOdometryRecord});
		const ObjectSum sum = {object->bytes.size(), hash_of(object->bytes)};
		send(record_of(kObjectRecord, sum));
	}
	send(char{kDamageRecord} + reader.damage());
	send(char{kClassRecord} + reader.missing_class());
}

void note(const std::string& record, LogSurvey& survey, std::vector<ObjectSum>& objects)
{
	const std::string text = record.substr(1);
	std::size_t number = 0;
	switch (record[0])
	{
		case kSensorRecord:
			survey.sensors.push_back({text});
			break;
		case kScanRecord:
			std::memcpy(&number, text.data(), sizeof number);
			survey.sensors.at(number).scans++;
			break;
		case kOdometryRecord:
			survey.odometry = "the log";
			break;
		case kObjectRecord:
			std::memcpy(&objects.emplace_back(), text.data(), sizeof(ObjectSum));
			break;
		case kClassRecord:
			survey.missing_class = text;
			break;
		default:
			survey.damage = text;
	}
}

constexpr const char* kCheckFile = "; check that it is the right file and whole";
constexpr const char* kCopyAgain = "; copy or record the rawlog again";

/// Returns what reading a rawlog may take, which is far more than reading a sound one does: it is read object by
/// object.
ProcessLimits limits_of_survey(const std::string& file)
{
	constexpr std::uint64_t kMemory = 900'000'000;    // [byte]
	constexpr std::uintmax_t kPerSecond = 1'000'000;  // [byte / s]
	constexpr unsigned kSeconds = 60;
	std::error_code error;
	const std::uintmax_t size = std::filesystem::file_size(file, error);
	return {kMemory, kSeconds + (error ? 0 : static_cast<unsigned>(size / kPerSecond))};
}

/// Passes on the objects that were surveyed, and ends before one whose bytes are no longer the same.
class SurveyedStream : public InputStream
{
   public:
	SurveyedStream(std::unique_ptr<InputStream> source, std::shared_ptr<const std::vector<ObjectSum>> objects)
	    : source_(std::move(source)), objects_(std::move(objects))
	{
	}

	std::size_t read(void* buffer, std::size_t count) override
	{
		if (taken_ == object_.size() && !fetch()) return 0;
		const std::size_t taken = std::min(count, object_.size() - taken_);
		std::memcpy(buffer, object_.data() + taken_, taken);
		taken_ += taken;
		return taken;
	}

	/// Returns what is wrong if the stream ended before an object that is not the same any more; else an empty text.
	const std::string& change() const { return change_; }

   private:
	/// Takes the next object from the file. Returns whether it is there as it was surveyed.
	bool fetch()
	{
		if (next_ == objects_->size() || !change_.empty()) return false;
		const ObjectSum& sum = (*objects_)[next_];
		object_.resize(sum.size);
		taken_ = 0;
		if (source_->read(object_.data(), sum.size) != sum.size || hash_of(object_) != sum.hash)
		{
			change_ = "has changed since the run began, after object " + std::to_string(next_) +
			          "; run again when nothing writes to it";
			object_.clear();
			return false;
		}
		next_++;
		return true;
	}

	std::unique_ptr<InputStream> source_;
	std::shared_ptr<const std::vector<ObjectSum>> objects_;
	std::size_t next_ = 0;              //!< [-] of these
	std::vector<std::uint8_t> object_;  //!< that is being passed on
	std::size_t taken_ = 0;             //!< [byte] of it
	std::string change_;
};

/// Reads a rawlog once more. MRPT's readers trust what they read, and the file may have changed since they read it in a
/// process of its own: here they get no other bytes than there.
class SurveyedReader : public LogReader
{
   public:
	SurveyedReader(std::unique_ptr<SurveyedStream> stream, const Labels& left_out)
	    : stream_(*stream), reader_(std::move(stream), left_out)
	{
	}

	std::optional<RawlogObject> next() override
	{
		auto object = reader_.next();
		if (!object) damage_ = stream_.change().empty() ? reader_.damage() : stream_.change();
		if (!object) missing_class_ = reader_.missing_class();
		return object;
	}

   private:
	SurveyedStream& stream_;  //!< of the reader
	RawlogReader reader_;
};
}  // namespace

std::optional<RawlogObject> RawlogReader::next()
{
	for (;;)
	{
		auto object = read();
		if (!object || !is_left_out(*object->object, left_out_)) return object;
	}
}

std::optional<RawlogObject> RawlogReader::read()
{
	if (!damage_.empty()) return std::nullopt;
	RawlogObject object;
	RecordingStream recording(*stream_, object.bytes);
	try
	{
		auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(recording);
		object.object = archive.ReadObject();
		read_contents(object.object, odometer_, left_out_, object);
		objects_++;
		return object;
	}
	catch (const std::exception& e)
	{
		if (is_out_of_memory(e)) throw std::bad_alloc();
		if (recording.at_clean_end() && objects_ > 0) return std::nullopt;
		if (!recording.read_error().empty())
			damage_ = unread(place(), recording.read_error());
		else if (recording.became_shorter())
			damage_ = "has become shorter while it was followed" + (objects_ > 0 ? ", " + place() : "") +
			          "; run again, and let nothing cut it meanwhile";
		else
			damage_ = recording.came_short() ? end_within_object() : unreadable(e);
		return std::nullopt;
	}
}

std::string RawlogReader::place() const
{
	return objects_ > 0 ? "after object " + std::to_string(objects_) : "";
}

std::string RawlogReader::end_within_object() const
{
	if (objects_ == 0) return std::string("is cut short within its first object, or not an MRPT rawlog") + kCheckFile;
	return "is cut short or damaged after object " + std::to_string(objects_) + kCopyAgain;
}

std::string RawlogReader::unreadable(const std::exception& error)
{
	missing_class_ = unknown_class(error);
	const std::string object = "object " + std::to_string(objects_ + 1);
	if (dynamic_cast<const Unreadable*>(&error)) return object + " " + error.what();
	if (!missing_class_.empty())
		return object + " is of the unknown class " + missing_class_ + "; load the module that has it first";
	if (const std::string version = unknown_version(error); !version.empty())
		return object + " is of version " + version + ", which this program's " + mrpt::system::MRPT_getVersion() +
		       " does not know; a newer MRPT wrote it, with which this program can be built";
	if (objects_ == 0) return std::string("is not an MRPT rawlog, or damaged from its start") + kCheckFile;
	return "is damaged after object " + std::to_string(objects_) + kCopyAgain;
}

Log open_rawlog(const std::string& file, const Stop& stop, const Labels& left_out)
{
	RawlogReader reader(open_unpacked(file), left_out);
	Log log;
	log.survey.format = "MRPT rawlog";
	log.survey.kind_of_scan = "CObservation2DRangeScan";
	const auto objects = std::make_shared<std::vector<ObjectSum>>();
	const ProcessLimits limits = limits_of_survey(file);
	const ProcessEnd end = read_in_own_process(
	    file, limits, [&](const Send& send) { tell_contents(reader, send); },
	    [&](const std::string& record) { note(record, log.survey, *objects); }, stop);
	if (end == ProcessEnd::kInterrupted) throw Interrupted();
	if (end == ProcessEnd::kOutOfMemory && available_memory() < limits.memory) throw std::bad_alloc();
	if (end != ProcessEnd::kDone) log.survey.damage = damage_that_ended(end, objects->size());
	log.read_for = [file, objects, left_out](const std::string&) {
		return std::make_unique<SurveyedReader>(
		    std::make_unique<SurveyedStream>(open_unpacked(file), objects), left_out);
	};
	return log;
}

std::string damage_that_ended(ProcessEnd end, std::size_t objects)
{
	const std::string where = objects > 0 ? "after object " + std::to_string(objects) : "from its start";
	const std::string advice = objects > 0 ? kCopyAgain : kCheckFile;
	switch (end)
	{
		case ProcessEnd::kOutOfMemory:
			return "takes too much memory to be read " + where + ": it is damaged there, or memory is short" + advice;
		case ProcessEnd::kOutOfTime:
			return "is damaged " + where + " (reading on takes too long)" + advice;
		default:
			return "is damaged " + where + " (MRPT's reader crashes there)" + advice;
	}
}
}  // namespace d2s1r::logs
