// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "odometry_of_scans.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>

namespace d2s1r::logs
{
namespace
{
constexpr double kLongestWaitForOdometry = 0.5;     // [s] of the log's clock, beyond the end of a scan
constexpr double kLongestSweep = 4;                 // [s] what takes longer is a mistake of the log
constexpr std::size_t kMostReadings = 1000;         // [-] of a scan
constexpr std::size_t kMostObjectsThatWait = 1000;  // [-] that wait

/// From when to when [s] the poses of the robot are needed: over the sweep and at the time of the observation.
std::pair<double, double> span_of(const mrpt::obs::CObservation2DRangeScan& scan, const SweepTime& sweep)
{
	const double stamp = to_seconds(scan.timestamp), last_beam = sweep.first_beam + sweep.duration;
	const auto [first, last] = std::minmax({0.0, sweep.first_beam, last_beam});
	return {stamp + first, stamp + last};
}

/// Forgets a sweep that takes longer than any, or whose observation has no time.
void check_sweep(const mrpt::obs::CObservation2DRangeScan& scan, SweepTime& sweep)
{
	const double longest = std::max(std::abs(sweep.duration), std::abs(sweep.first_beam));
	if (!(longest < kLongestSweep) || !(to_seconds(scan.timestamp) > 0)) sweep = {};
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
		if (object->increment) by_increments_ = by_increments_.value_or(mrpt::poses::CPose2D()) + *object->increment;
		for (std::size_t i = 0; i < object->scans.size(); i++)
		{
			const double time = to_seconds(object->scans[i]->timestamp);
			check_sweep(*object->scans[i], object->details[i].sweep);
			newest_ = std::max(newest_, time);
			if (by_increments_ && time > 0) add({time, by_increments_->asTPose()});
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
			if (object.details[i].sweep.duration == 0) continue;
			const double end = span_of(*object.scans[i], object.details[i].sweep).second;
			const double known = readings_.empty() ? 0 : readings_.back().first;
			if (known < end && newest_ < end + kLongestWaitForOdometry) return false;
		}
		return true;
	}

	/// Gives a scan the readings over its sweep, two before, by which the motion is extrapolated, and one after.
	void complete(const mrpt::obs::CObservation2DRangeScan& scan, ScanDetails& details) const
	{
		if (details.sweep.duration == 0) return;
		const auto [start, end] = span_of(scan, details.sweep);
		const auto is_before = [](const StampedPose& reading, double time) { return reading.first < time; };
		auto first = std::lower_bound(readings_.begin(), readings_.end(), start, is_before);
		auto last = std::lower_bound(first, readings_.end(), end, is_before);
		first -= std::min<std::ptrdiff_t>(2, first - readings_.begin());
		if (last != readings_.end()) ++last;
		details.odometry.assign(first, last);
	}

	std::unique_ptr<LogReader> reader_;
	bool waits_;
	std::deque<RawlogObject> objects_;                   //!< that have been read
	std::deque<StampedPose> readings_;                   //!< of the odometry, by time
	std::optional<mrpt::poses::CPose2D> by_increments_;  //!< of action collections, which end at the next scan
	double newest_ = 0;                                  //!< [s] time of all that has been read
	bool is_at_end_ = false;
};
}  // namespace

std::unique_ptr<LogReader> with_odometry(std::unique_ptr<LogReader> reader, bool waits)
{
	return std::make_unique<ReaderWithOdometry>(std::move(reader), waits);
}
}  // namespace d2s1r::logs
