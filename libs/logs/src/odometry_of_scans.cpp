// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "odometry_of_scans.h"

#include <algorithm>
#include <deque>
#include <optional>
#include <utility>

namespace d2s1r::logs
{
namespace
{
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
}  // namespace

std::unique_ptr<LogReader> with_odometry(
    std::unique_ptr<LogReader> reader, const LogSurvey& survey, const std::string& label)
{
	return std::make_unique<ReaderWithOdometry>(std::move(reader), survey, label);
}
}  // namespace d2s1r::logs
