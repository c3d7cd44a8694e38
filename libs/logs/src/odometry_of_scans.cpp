// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "odometry_of_scans.h"

#include <ros/odometry_track.h>

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
constexpr std::size_t kMostObjectsThatWait = 1000;  // [-] that wait

/// From when to when [s] the poses of the robot are needed: over the sweep and at the time of the observation.
std::pair<double, double> span_of(const mrpt::obs::CObservation2DRangeScan& scan, const SweepTime& sweep)
{
	const double stamp = to_seconds(scan.timestamp);
	const auto [first, last] = sweep.span();
	return {stamp + first, stamp + last};
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
			SweepTime& sweep = object->details[i].sweep;
			sweep = time > 0 ? sweep.checked() : SweepTime();
			newest_ = std::max(newest_, time);
			if (by_increments_ && time > 0) add({time, by_increments_->asTPose()});
		}
		if (object->odometry && object->odometry_time > 0) add({object->odometry_time, object->odometry->asTPose()});
		objects_.push_back(std::move(*object));
		return true;
	}

	/// Takes a reading of the odometry.
	void add(const StampedPose& reading)
	{
		readings_.add(reading);
		newest_ = std::max(newest_, readings_.newest().value_or(0));
	}

	bool is_complete(const RawlogObject& object) const
	{
		if (!waits_ || objects_.size() > kMostObjectsThatWait) return true;
		for (std::size_t i = 0; i < object.scans.size(); i++)
		{
			if (object.details[i].sweep.is_instant()) continue;
			const double end = span_of(*object.scans[i], object.details[i].sweep).second;
			if (readings_.newest().value_or(0) < end && newest_ < end + kLongestWaitForOdometry) return false;
		}
		return true;
	}

	/// Gives a scan the readings over its sweep.
	void complete(const mrpt::obs::CObservation2DRangeScan& scan, ScanDetails& details) const
	{
		if (details.sweep.is_instant()) return;
		const auto [start, end] = span_of(scan, details.sweep);
		details.odometry = readings_.over(start, end);
	}

	std::unique_ptr<LogReader> reader_;
	bool waits_;
	std::deque<RawlogObject> objects_;                   //!< that have been read
	ros::OdometryTrack readings_;                        //!< of the odometry
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
