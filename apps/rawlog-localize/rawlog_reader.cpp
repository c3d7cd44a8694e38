// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "rawlog_reader.h"

#include "errors.h"

#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>

#include <filesystem>

namespace d2s1r::app
{
namespace
{
/// Passes bytes on and keeps them; a read that comes short throws, where MRPT's archive would go on with garbage.
class RecordingStream : public mrpt::io::CStream
{
   public:
	RecordingStream(mrpt::io::CStream& source, std::vector<std::uint8_t>& bytes) : source_(source), bytes_(bytes) {}

	std::size_t Read(void* buffer, std::size_t count) override
	{
		const std::size_t got = source_.Read(buffer, count);
		if (got != count) at_end_ = got == 0 && bytes_.empty();
		if (got != count) throw mrpt::serialization::CExceptionEOF("end of file");
		const auto* first = static_cast<const std::uint8_t*>(buffer);
		bytes_.insert(bytes_.end(), first, first + got);
		return got;
	}
	std::size_t Write(const void*, std::size_t) override { throw std::logic_error("read-only stream"); }
	std::uint64_t Seek(std::int64_t, TSeekOrigin) override { throw std::logic_error("stream without positions"); }
	std::uint64_t getTotalBytesCount() const override { return source_.getTotalBytesCount(); }
	std::uint64_t getPosition() const override { return bytes_.size(); }

	bool at_end() const { return at_end_; }

   private:
	mrpt::io::CStream& source_;
	std::vector<std::uint8_t>& bytes_;
	bool at_end_ = false;  //!< [-] the file ended before the first byte of the object
};

Scans scans_in(const mrpt::serialization::CSerializable::Ptr& object)
{
	Scans scans;
	const auto add = [&](const auto& observation)
	{
		if (auto scan = std::dynamic_pointer_cast<mrpt::obs::CObservation2DRangeScan>(observation))
			scans.push_back(scan);
	};
	if (const auto frame = std::dynamic_pointer_cast<mrpt::obs::CSensoryFrame>(object))
		for (const auto& observation : *frame) add(observation);
	else
		add(object);
	return scans;
}

void read_odometry(const mrpt::serialization::CSerializable::Ptr& object, RawlogObject& into)
{
	if (const auto actions = std::dynamic_pointer_cast<mrpt::obs::CActionCollection>(object))
	{
		const auto movement = actions->getBestMovementEstimation();
		if (movement) into.increment = movement->poseChange->getMeanVal();
	}
	const auto reading = std::dynamic_pointer_cast<mrpt::obs::CObservationOdometry>(object);
	// what an earlier run of rawlog-localize wrote is no measurement
	if (reading && reading->sensorLabel != kPseudoOdometryLabel) into.odometry = reading->odometry;
}
}  // namespace

RawlogReader::RawlogReader(const std::string& file)
{
	std::error_code error;
	if (!std::filesystem::exists(file, error))
		throw UserError(
		    kBadInput, file,
		    (error ? "cannot be reached (" + error.message() + ")" : "no such rawlog") + "; check the path");
	if (std::filesystem::is_directory(file, error)) throw UserError(kBadInput, file, "is a folder; name a rawlog file");
	if (std::filesystem::file_size(file, error) == 0)
		throw UserError(kBadInput, file, "is empty; copy or record the rawlog again");
	if (!stream_.open(file)) throw UserError(kBadInput, file, "cannot be opened; check its permissions");
}

std::optional<RawlogObject> RawlogReader::next()
{
	if (!damage_.empty()) return std::nullopt;
	RawlogObject object;
	RecordingStream recording(stream_, object.bytes);
	try
	{
		auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(recording);
		const auto read = archive.ReadObject();
		object.scans = scans_in(read);
		read_odometry(read, object);
		objects_++;
		return object;
	}
	catch (const mrpt::serialization::CExceptionEOF&)
	{
		if (recording.at_end()) return std::nullopt;
		damage_ = "is cut short or damaged after object " + std::to_string(objects_);
	}
	catch (const std::exception& e)
	{
		damage_ = "cannot be read after object " + std::to_string(objects_) + " (" + one_line(e) + ")";
	}
	if (objects_ == 0) damage_ = "is not an MRPT rawlog, or damaged from its start";
	return std::nullopt;
}
}  // namespace d2s1r::app
