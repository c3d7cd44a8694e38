// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "odometry_of_scans.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

namespace d2s1r::logs
{
namespace
{
constexpr double kLongestWaitForOdometry = 0.5;  // [s] of the log's clock, beyond the end of a scan
constexpr double kLongestScan = 10;              // [s] what takes longer is a mistake of the log
constexpr double kLongestGap = 1;                // [s] between two readings: beyond, they do not tell what was between
constexpr std::size_t kMostReadings = 1000;      // [-] of a scan
constexpr std::size_t kMostObjectsThatWait = 1000;  // [-] that wait

/// The time [s] of a scan's last beam.
double end_of(const mrpt::obs::CObservation2DRangeScan& scan, const ScanDetails& details)
{
	return to_seconds(scan.timestamp) + details.time_step * (static_cast<double>(scan.getScanSize()) - 1);
}

/// Makes a time that a log tells 0 if it cannot be one.
void make_sound(const mrpt::obs::CObservation2DRangeScan& scan, ScanDetails& details)
{
	const auto beams = static_cast<double>(std::max<std::size_t>(scan.getScanSize(), 1));
	if (!(details.time_step > 0 && details.time_step * beams < kLongestScan)) details.time_step = 0;
	if (!(details.scan_time > 0 && details.scan_time < kLongestScan)) details.scan_time = 0;
}

class ReaderWithOdometry : public LogReader
{
   public:
	ReaderWithOdometry(std::unique_ptr<LogReader> reader, bool waits) : reader_(std::move(reader)), waits_(waits) {}

	std::optional<RawlogObject> next() override
	{
		while (objects_.empty() || !is_complete(objects_.front()))
			if (!read()) break;
		if (objects_.empty())
		{
			damage_ = reader_->damage();
			missing_class_ = reader_->missing_class();
			return std::nullopt;
		}
		RawlogObject object = std::move(objects_.front());
		objects_.pop_front();
		for (std::size_t i = 0; i < object.scans.size(); i++) complete(*object.scans[i], object.details[i]);
		return object;
	}

   private:
	/// Returns whether there was another object.
	bool read()
	{
		if (is_at_end_) return false;
		auto object = reader_->next();
		is_at_end_ = !object;
		if (!object) return false;
		for (std::size_t i = 0; i < object->scans.size(); i++)
		{
			make_sound(*object->scans[i], object->details[i]);
			newest_ = std::max(newest_, to_seconds(object->scans[i]->timestamp));
		}
		if (object->odometry && object->odometry_time > 0) add({object->odometry_time, object->odometry->asTPose()});
		objects_.push_back(std::move(*object));
		return true;
	}

	/// Takes a reading of the odometry. One before the others shows that the clock was set back.
	void add(const StampedPose& reading)
	{
		if (!readings_.empty() && reading.first < readings_.front().first) readings_.clear();
		if (!readings_.empty() && reading.first <= readings_.back().first) return;
		readings_.push_back(reading);
		if (readings_.size() > kMostReadings) readings_.pop_front();
		newest_ = std::max(newest_, reading.first);
	}

	bool is_complete(const RawlogObject& object) const
	{
		if (!waits_ || objects_.size() > kMostObjectsThatWait) return true;
		for (std::size_t i = 0; i < object.scans.size(); i++)
		{
			if (!(object.details[i].time_step > 0)) continue;
			const double end = end_of(*object.scans[i], object.details[i]);
			const double known = readings_.empty() ? 0 : readings_.back().first;
			if (known < end && newest_ < end + kLongestWaitForOdometry) return false;
		}
		return true;
	}

	/// Gives a scan the readings from the last before its first beam to the first after its last beam. If one of these
	/// is more than a second away, it is none.
	void complete(const mrpt::obs::CObservation2DRangeScan& scan, ScanDetails& details) const
	{
		if (!(details.time_step > 0) || readings_.empty()) return;
		const double start = to_seconds(scan.timestamp), end = end_of(scan, details);
		const auto is_before = [](const StampedPose& reading, double time) { return reading.first < time; };
		const auto is_after = [](double time, const StampedPose& reading) { return time < reading.first; };
		auto first = std::upper_bound(readings_.begin(), readings_.end(), start, is_after);
		auto last = std::lower_bound(readings_.begin(), readings_.end(), end, is_before);
		if (first != readings_.begin() && start - std::prev(first)->first < kLongestGap) --first;
		if (last != readings_.end() && last->first - end < kLongestGap) ++last;
		if (first < last) details.odometry.assign(first, last);
	}

	std::unique_ptr<LogReader> reader_;
	bool waits_;
	std::deque<RawlogObject> objects_;  //!< that have been read
	std::deque<StampedPose> readings_;  //!< of the odometry, by time
	double newest_ = 0;                 //!< [s] time of all that has been read
	bool is_at_end_ = false;
};
}  // namespace

std::unique_ptr<LogReader> with_odometry(std::unique_ptr<LogReader> reader, bool waits)
{
	return std::make_unique<ReaderWithOdometry>(std::move(reader), waits);
}
}  // namespace d2s1r::logs
