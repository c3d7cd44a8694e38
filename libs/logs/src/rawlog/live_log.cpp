// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "logs/errors.h"
#include "rawlog/rawlog_reader.h"
#include "unpacking_stream.h"

namespace d2s1r::logs
{
namespace
{
/// A live log is read in a process of its own, and arrives as records: a letter and what it is about.
enum LiveRecord : char
{
	kObjectBytes = 'n',  //!< the bytes of an object that MRPT can read
	kLogDamage = 'd',    //!< RawlogReader::damage()
	kLogClass = 'c'      //!< RawlogReader::missing_class()
};

void tell_objects(int descriptor, bool follows, const Send& send)
{
	RawlogReader reader(unpack(descriptor, follows));
	while (const auto object = reader.read())
		send(std::string(1, kObjectBytes).append(object->bytes.begin(), object->bytes.end()));
	send(char{kLogDamage} + reader.damage());
	send(char{kLogClass} + reader.missing_class());
}

/// What another process has read of a live log.
class LiveStream : public InputStream
{
   public:
	LiveStream(int descriptor, bool follows, const Stop& stop)
	    : process_(
	          kLimits, [=](const Send& send) { tell_objects(descriptor, follows, send); }, stop)
	{
	}

	std::size_t read(void* buffer, std::size_t count) override
	{
		if (left_.empty()) receive();
		const std::size_t taken = std::min(count, left_.size());
		std::memcpy(buffer, left_.data(), taken);
		left_.remove_prefix(taken);
		return taken;
	}

	/// Returns what is wrong with the log, after `objects` of it; empty if nothing is.
	std::string damage(std::size_t objects)
	{
		const ProcessEnd end = process_.end();
		const bool is_told = end == ProcessEnd::kDone || end == ProcessEnd::kInterrupted;
		return is_told ? damage_ : damage_that_ended(end, objects);
	}

	const std::string& missing_class() const { return missing_class_; }

   private:
	static constexpr ProcessLimits kLimits = {900'000'000, std::numeric_limits<unsigned>::max()};

	void receive()
	{
		auto record = process_.next();
		if (!record) return;
		record_ = std::move(*record);
		const auto text = std::string_view(record_).substr(1);
		if (record_[0] == kObjectBytes)
			left_ = text;
		else if (record_[0] == kLogDamage)
			damage_ = text;
		else
			missing_class_ = text;
		if (record_[0] == kLogDamage) receive();  // the class comes with it
	}

	OwnProcess process_;
	std::string record_;
	std::string_view left_;  //!< in the record
	std::string damage_, missing_class_;
};

class LiveReader : public LogReader
{
   public:
	LiveReader(std::unique_ptr<LiveStream> stream, const Labels& left_out)
	    : stream_(*stream), reader_(std::move(stream), left_out)
	{
	}

	std::optional<RawlogObject> next() override
	{
		return returned_ < early_.size() ? std::move(early_[returned_++]) : read();
	}

	/// Returns the label of the first scan; no value if there is none, or too much comes before it. The objects up to
	/// it will be read again.
	std::optional<std::string> first_label()
	{
		constexpr std::size_t kMostKept = 100'000'000, kOfEach = 1000;  // [byte] that are kept
		for (std::size_t kept = 0; kept < kMostKept;)
		{
			const auto& object = early_.emplace_back(read());
			if (!object) return std::nullopt;
			if (!object->scans.empty()) return object->scans.front()->label;
			kept += object->bytes.size() + kOfEach;
		}
		damage_ = "shows no 2D laser scan in its first " + std::to_string(objects_) +
		          " objects; name the label of a laser that comes later";
		return std::nullopt;
	}

   private:
	std::optional<RawlogObject> read()
	{
		auto object = reader_.next();
		if (object)
		{
			objects_++;
			return object;
		}
		damage_ = stream_.damage(objects_);
		missing_class_ = stream_.missing_class();
		if (objects_ == 0 && !damage_.empty() && missing_class_.empty())
			damage_ +=
			    "; of logs that are being written only rawlogs can be read: read a bag or a CARMEN log from its "
			    "file, once it is complete";
		return object;
	}

	LiveStream& stream_;  //!< of the reader
	RawlogReader reader_;
	std::size_t objects_ = 0;                         //!< [-] read so far
	std::vector<std::optional<RawlogObject>> early_;  //!< that were read for first_label()
	std::size_t returned_ = 0;                        //!< [-] of these
};

int open_input(const std::string& file)
{
	if (file == kStandardInput)
	{
		if (isatty(STDIN_FILENO)) throw LogError("standard input", "is a terminal; pipe a rawlog into it");
		return STDIN_FILENO;
	}
	const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
	struct stat status = {};
	if (descriptor < 0 || fstat(descriptor, &status) != 0) throw cannot_open(file);
	if (S_ISREG(status.st_mode)) return descriptor;
	close(descriptor);
	if (S_ISDIR(status.st_mode))
		throw LogError(
		    file,
		    "is a folder, as a ROS 2 bag is, which cannot be read while it is written; read it once it is complete");
	throw LogError(file, "is not a file that can grow; pipe it into standard input, and give - as its name");
}

/// \throws LogError if the system refuses another process
std::unique_ptr<LiveReader> read_in_own_process(
    const std::string& file, int descriptor, bool follows, const Stop& stop, const Labels& left_out)
try
{
	return std::make_unique<LiveReader>(std::make_unique<LiveStream>(descriptor, follows, stop), left_out);
}
catch (const std::runtime_error& refusal)
{
	throw LogError(file == kStandardInput ? "standard input" : file, refusal.what());
}
}  // namespace

Log open_live_log(
    const std::string& file, const std::optional<std::string>& label, const Stop& stop, const Labels& left_out,
    const std::function<void()>& prepare)
{
	const bool follows = file != kStandardInput;
	const int descriptor = open_input(file);
	auto reader = read_in_own_process(file, descriptor, follows, stop, left_out);
	if (follows) close(descriptor);  // the other process has it
	prepare();
	Log log;
	log.survey.format = "MRPT rawlog";
	log.survey.kind_of_scan = "CObservation2DRangeScan";
	log.survey.is_live = true;
	const auto used = label ? label : reader->first_label();
	if (!used && stop()) throw Interrupted();
	if (used) log.survey.sensors = {{*used, std::numeric_limits<std::size_t>::max()}};
	if (!used) log.survey.damage = reader->damage();
	if (!used) log.survey.missing_class = reader->missing_class();
	log.read_for = [holder = std::make_shared<std::unique_ptr<LogReader>>(std::move(reader))](const std::string&)
	{ return std::move(*holder); };
	return log;
}
}  // namespace d2s1r::logs
