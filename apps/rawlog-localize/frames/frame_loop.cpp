// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/frame_loop.h"

#include <base/threads.h>
#include <d2s1r/motion.h>
#include <d2s1r/scan_accumulator.h>
#include <d2s1r/tracker.h>
#include <d2s1r/window_localizer.h>
#include <ros/running_calibration.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

namespace d2s1r::app
{
namespace
{
using Clock = std::chrono::steady_clock;

/// Adds the wall-clock time of its own life to a sum.
class ScopedTimer
{
   public:
	/// \param sum_ms [ms] must outlive the timer
	explicit ScopedTimer(double& sum_ms) : sum_ms_(sum_ms) {}
	~ScopedTimer() { sum_ms_ += std::chrono::duration<double, std::milli>(Clock::now() - start_).count(); }
	ScopedTimer(const ScopedTimer&) = delete;
	ScopedTimer& operator=(const ScopedTimer&) = delete;

   private:
	double& sum_ms_;
	Clock::time_point start_ = Clock::now();
};

constexpr std::size_t kScansPerThread = 8;  //!< [-] scans that are read ahead of those that have been followed
constexpr std::size_t kMostObjects = 1024;  //!< [-] objects that are, to bound the memory of logs with few scans

using Lasers = std::vector<PlacedObservation>;

struct Job
{
	std::size_t frame = 0;
	LoggedScan logged;
	Clock::time_point read_at = {};                  //!< when the scan had been read
	Lasers lasers = {};                              //!< what is merged, `logged` last; empty: each scan is used alone
	std::optional<mrpt::poses::CPose2D> robot = {};  //!< by the odometry, see logs::ScanDetails
	std::optional<mrpt::poses::CPose2D> tracker = {};  //!< in the map, by the tracker that is judged
	Scan scan = {};                                    //!< that is localized
	std::optional<Localization> result = {};
};

Scan scan_of(const Job& job, const ScanParameters& parameters)
{
	return job.lasers.empty() ? scan_of(job.logged, parameters) : merge_scans(job.lasers, parameters);
}

/// An object of the log with its scans that are to be localized.
struct Item
{
	logs::RawlogObject object;
	std::vector<Job> jobs = {};
	std::size_t unfinished = 0;  //!< [-] jobs without a result
	std::size_t bytes = 0;       //!< that it takes, about
};

/// Reads the objects of a log, and finds the scans in them that are to be localized.
class ItemReader
{
   public:
	ItemReader(logs::LogReader& reader, const FrameSelection& selection, const Approach& approach)
	    : reader_(reader), selection_(selection), approach_(approach)
	{
	}

	/// Returns the next object; no value after all that can be read of the log.
	std::optional<Item> read()
	{
		const ScopedTimer timer(milliseconds_);
		auto object = reader_.next();
		if (!object) return std::nullopt;
		Item item = {std::move(*object)};
		item.bytes = weight_of(item.object);
		for (std::size_t i = 0; i < item.object.scans.size(); i++)
		{
			const auto& scan = item.object.scans[i];
			const logs::ScanDetails& details = item.object.details[i];
			const bool is_merged = approach_.merge_lasers && details.unusable.text.empty();
			if (is_merged)
				last_scans_.add(
				    scan->label, details.time, std::make_shared<const RangeScan>(*scan), details.robot, details.motion);
			if (scan->label != selection_.label)
			{
				constexpr std::size_t kMostLabels = 100;
				if (scans_ == 0 && other_labels_.size() < kMostLabels) other_labels_.insert(scan->label);
				continue;
			}
			if (selection_.contains(scans_))
				item.jobs.push_back(
				    {scans_, logged_scan(scan, details), Clock::now(),
				     is_merged ? last_scans_.with(scan->label) : Lasers(), details.robot,
				     approach_.tracker ? approach_.tracker->pose_at(details.time, *reader_.track()) : std::nullopt});
			scans_++;
		}
		for (const Job& job : item.jobs)
			for (const PlacedObservation& merged : job.lasers) item.bytes += ros::weight_of(merged.observation->size());
		if (!item.object.bytes.empty())  // else these are made of it
		{
			item.object.scans.clear();
			item.object.object.reset();
		}
		item.unfinished = item.jobs.size();
		return item;
	}

	/// Returns the number of scans of the sensor seen so far.
	std::size_t scans() const { return scans_; }

	const std::set<std::string>& other_labels() const { return other_labels_; }

	/// Returns the time [s] that reading took so far.
	double seconds() const { return 1e-3 * milliseconds_; }

   private:
	logs::LogReader& reader_;
	const FrameSelection& selection_;
	const Approach& approach_;
	ros::LastScans last_scans_;
	std::size_t scans_ = 0;
	std::set<std::string> other_labels_;
	double milliseconds_ = 0;
};

/// Takes what scans say alone, follows them with the window and the fusion, and hands the frames on.
class Follower
{
   public:
	Follower(const Approach& approach, const FrameSink& sink)
	    : approach_(approach), sink_(sink), calibration_({}, approach.calibrates)
	{
		begin();
	}

	void begin()
	{
		if (approach_.window) window_.emplace(approach_.atlas, *approach_.window);
		if (approach_.track) tracker_.emplace(approach_.atlas);
	}

	/// Follows the scans of an object, all of which have been localized.
	void follow(Item& item)
	{
		{
			const ScopedTimer timer(writing_ms_);
			sink_.take_object(item.object);
		}
		for (Job& job : item.jobs)
			if (!is_enough_) follow(job);
	}

	bool is_enough() const { return is_enough_; }

	std::size_t frames() const { return frames_; }

	/// Returns the time [s] that the sink took so far.
	double writing_seconds() const { return 1e-3 * writing_ms_; }

	const LeftOutReadings& left_out() const { return left_out_; }

	/// Returns what the scans followed so far tell of the odometry.
	const OdometryEstimate& odometry() const { return odometry_check_.estimate(); }

   private:
	/// Returns where the robot was by the odometry as the drive has shown it. Odometry of another clock is left out:
	/// what it says of the time of a scan may not have been read yet.
	std::optional<mrpt::poses::CPose2D> robot_of(const Job& job) const
	{
		const ros::Overrides& in_use = calibration_.in_use();
		if (!job.robot || in_use.odometry_clock != 0) return std::nullopt;
		return ros::odometry_as(in_use, *job.robot);
	}

	/// Returns when beams were taken, and how the robot moved meanwhile by the same odometry.
	Sweep sweep_as_shown(Sweep sweep) const
	{
		const ros::Overrides& in_use = calibration_.in_use();
		if (in_use.odometry_clock != 0) sweep.motion.clear();
		for (TimedPose& pose : sweep.motion)
			pose.robot = ros::odometry_as(in_use, mrpt::poses::CPose2D(pose.robot)).asTPose();
		return sweep;
	}

	/// Reads a scan as the drive has shown, and lets it show more.
	void calibrate(Job& job)
	{
		constexpr std::size_t kMostReadings = 1000;
		const LoggedScan logged = job.logged;
		const ros::Time time = ros::from_time(logged.observation->timestamp);
		calibration_.follow(time, robot_);
		if (robot_) readings_.emplace_back(time, robot_->asTPose());
		if (readings_.size() > kMostReadings) readings_.erase(readings_.begin());
		const auto localized = [&](const Scan& scan) { return approach_.atlas.localize(scan, approach_.query); };
		const auto& parameters = approach_.first().parameters().scan;
		const auto read_anew = [&]
		{
			job.logged = read_by(calibration_.in_use(), logged);
			job.logged.sweep = sweep_as_shown(logged.sweep);
			job.scan = scan_of(job, parameters);
			job.result = localized(job.scan);
		};
		if (!ros::entries_of(calibration_.in_use()).empty()) read_anew();
		if (!calibration_.wants(time)) return;
		const ros::UncalibratedScan recorded{
		    time,
		    *read_by(calibration_.recorded(), logged).observation,
		    logged.observation->laser(),
		    {},
		    sweep_as_shown(logged.sweep)};
		const auto is_found = [&](const RangeScan& scan, const Sweep& motion)
		{ return localized(make_scan(scan, parameters, motion)).status == Status::kLocalized; };
		const bool is_other = job.result->status == Status::kLocalized
		                          ? calibration_.add(
		                                approach_.atlas.at(job.result->best().map).localizer->grid(), recorded,
		                                job.result->best().pose.asTPose(), readings_)
		                          : calibration_.miss(recorded, is_found);
		if (is_other)
		{
			begin();
			readings_.clear();
			robot_ = robot_of(job);
			read_anew();
		}
		const std::string shown = calibration_.description();
		if (shown != std::exchange(told_, shown) && !shown.empty() && sink_.tell) sink_.tell(shown);
	}

	void follow(Job& job)
	{
		std::optional<mrpt::poses::CPose2D> motion;
		const auto before = std::exchange(robot_, robot_of(job));
		if (robot_ && before) motion = *robot_ - *before;
		if (motion && !is_plausible(*motion)) motion.reset();
		if (approach_.calibrates) calibrate(job);
		const Localization& one_shot = *job.result;
		odometry_check_.checked(motion, one_shot);
		const double time = logs::to_seconds(job.logged.observation->timestamp);
		Frame frame{job.frame, time, one_shot, {}, {}, {}, {}, job.read_at};
		if (window_)
		{
			frame.alone = one_shot;
			frame.result = window_->add(job.scan, one_shot, motion);
		}
		if (tracker_) frame.tracked = tracker_->add(time, job.scan, motion);
		doubt(frame.result);
		if (frame.alone) doubt(*frame.alone);
		if (frame.tracked) doubt(*frame.tracked);
		if (approach_.tracker)
			frame.tracker = approach_.tracker->add(approach_.first(), job.scan, frame.result, motion, job.tracker);
		const ScanPtr observation = observation_of(job.logged);
		if (approach_.fusion) frame.fused = approach_.fusion->step(*observation, one_shot, motion);
		left_out_.add(job.scan, observation->size());
		const ScopedTimer timer(writing_ms_);
		is_enough_ = !sink_.take_frame(frame, job.scan, observation);
		frames_++;
	}

	void doubt(Localization& result) const { ros::apply(ros::both(calibration_.doubt(), approach_.doubt), result); }

	const Approach& approach_;
	const FrameSink& sink_;
	std::size_t frames_ = 0;
	bool is_enough_ = false;
	double writing_ms_ = 0;
	std::optional<mrpt::poses::CPose2D> robot_;  //!< at the last scan, see robot_of()
	ros::RunningCalibration calibration_;
	ros::RunningCalibration::Readings readings_;  //!< as they are in use
	std::string told_;                            //!< of the calibration
	OdometryCheck odometry_check_;
	LeftOutReadings left_out_;
	std::optional<WindowLocalizer> window_;
	std::optional<Tracker> tracker_;
};

/// What the threads share. Each does whatever can be done next, and what brings a result out soonest goes first:
/// objects whose scans have been localized are followed in the order of the log, else a scan is localized, else an
/// object is read. So a frame is handed on as soon as it and those before it are known, also if the log is still being
/// written.
class FramePipeline
{
   public:
	FramePipeline(ItemReader& reader, Follower& follower, const Approach& approach, ProgressBar& progress)
	    : reader_(reader), follower_(follower), approach_(approach), progress_(progress)
	{
	}

	/// Is to be called by each thread. Returns when all is done, or nothing more is wanted, or another thread has
	/// failed. \throws what reading, localizing or following throws
	void work()
	{
		std::unique_lock<std::mutex> lock(mutex_);
		for (;;)
		{
			const auto task = choose();
			if (!task && busy_ == 0) return;
			if (!task)
			{
				changed_.wait(lock);
				continue;
			}
			busy_++;
			try
			{
				(this->*task)(lock);
			}
			catch (...)
			{
				if (!lock.owns_lock()) lock.lock();
				failed_ = true;
				finish_task();
				throw;
			}
			finish_task();
		}
	}

   private:
	using Lock = std::unique_lock<std::mutex>;
	using Task = void (FramePipeline::*)(Lock&);
	using Answers = std::map<std::size_t, Localization>;

	/// Returns what this thread can do; null if there is nothing until another thread has done its task.
	Task choose() const
	{
		if (failed_ || is_enough_) return nullptr;
		if (!is_following_ && !items_.empty() && items_.front().unfinished == 0) return &FramePipeline::follow;
		if (interrupted()) return nullptr;
		if (!waiting_.empty()) return &FramePipeline::localize;
		const auto most_jobs = kScansPerThread * static_cast<std::size_t>(approach_.threads);
		const bool has_room =
		    items_.size() < kMostObjects && unfollowed_jobs_ < most_jobs && bytes_ < ros::kMostBytesWaiting;
		return !is_reading_ && !at_end_ && has_room ? &FramePipeline::read : nullptr;
	}

	void finish_task()
	{
		busy_--;
		changed_.notify_all();
	}

	void follow(Lock& lock)
	{
		is_following_ = true;
		Item& item = items_.front();
		lock.unlock();
		follower_.follow(item);
		progress_.show(follower_.frames());
		lock.lock();
		is_enough_ = follower_.is_enough();
		unfollowed_jobs_ -= item.jobs.size();
		bytes_ -= item.bytes;
		items_.pop_front();
		is_following_ = false;
	}

	void localize(Lock& lock)
	{
		const auto [item, job] = waiting_.front();
		waiting_.pop_front();
		lock.unlock();
		job->scan = scan_of(*job, approach_.first().parameters().scan);
		job->result = answer_to(*job);
		lock.lock();
		if (!interrupted()) item->unfinished--;  // else the search may have been stopped
	}

	Localization answer_to(const Job& job) const
	{
		const auto known = approach_.answers ? approach_.answers->find(job.frame) : Answers::const_iterator();
		if (approach_.answers && known != approach_.answers->end()) return known->second;
		return approach_.atlas.localize(job.scan, approach_.query);
	}

	void read(Lock& lock)
	{
		is_reading_ = true;
		lock.unlock();
		auto read = reader_.read();
		lock.lock();
		is_reading_ = false;
		at_end_ = !read;
		if (!read) return;
		Item& item = items_.emplace_back(std::move(*read));
		unfollowed_jobs_ += item.jobs.size();
		bytes_ += item.bytes;
		for (Job& job : item.jobs) waiting_.emplace_back(&item, &job);
	}

	ItemReader& reader_;
	Follower& follower_;
	const Approach& approach_;
	ProgressBar& progress_;
	std::mutex mutex_;  //!< for all below
	std::condition_variable changed_;
	std::deque<Item> items_;                          //!< read and not yet followed, in the order of the log
	std::deque<std::pair<Item*, Job*>> waiting_;      //!< jobs in them that nobody has begun
	std::size_t unfollowed_jobs_ = 0;                 //!< [-] jobs in them
	std::size_t bytes_ = 0;                           //!< that they take
	std::size_t busy_ = 0;                            //!< [-] threads that do a task
	bool is_following_ = false, is_reading_ = false;  //!< whether a thread does
	bool at_end_ = false;                             //!< of the log
	bool is_enough_ = false;                          //!< whether no more frames are wanted
	bool failed_ = false;                             //!< whether a task has
};
}  // namespace

void LeftOutReadings::add(const Scan& scan, std::size_t of_observation)
{
	readings += of_observation;
	repeated += scan.repeated;
	lost += scan.lost;
	scans++;
	scans_with_repeated += scan.repeated > 0 ? 1 : 0;
	scans_with_lost += scan.lost > 0 ? 1 : 0;
}

LoopResult localize_log(
    logs::LogReader& reader, const FrameSelection& selection, const Approach& approach, const FrameSink& sink,
    ProgressBar& progress)
{
	const auto start = Clock::now();
	ItemReader items(reader, selection, approach);
	Follower follower(approach, sink);
	FramePipeline pipeline(items, follower, approach, progress);
	run_on_threads(approach.threads, [&] { pipeline.work(); });
	// Reading and writing take one thread of those there are.
	const double seconds = std::chrono::duration<double>(Clock::now() - start).count() -
	                       (items.seconds() + follower.writing_seconds()) / approach.threads;
	return {
	    describe_damage(reader.damage(), reader.missing_class()),
	    seconds,
	    items.scans(),
	    follower.frames(),
	    follower.is_enough(),
	    items.other_labels(),
	    follower.odometry(),
	    reader.track() != nullptr ? reader.track()->description() : "",
	    follower.left_out()};
}
}  // namespace d2s1r::app
