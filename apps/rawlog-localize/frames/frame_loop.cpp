// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/frame_loop.h"

#include <d2s1r/motion.h>
#include <d2s1r/scan_accumulator.h>
#include <d2s1r/window_localizer.h>

#include <atomic>
#include <chrono>
#include <exception>
#include <thread>
#include <utility>

namespace d2s1r::app
{
namespace
{
constexpr std::size_t kScansPerThread = 8;  //!< [-] scans that a batch holds for each thread
constexpr std::size_t kMostObjects = 1024;  //!< [-] objects in a batch, which bounds the memory of logs with few scans

/// Returns [s] since the epoch, 0 if the observation has no time.
double seconds(const mrpt::obs::CObservation& observation)
{
	return observation.timestamp == INVALID_TIMESTAMP ? 0.0 : mrpt::Clock::toDouble(observation.timestamp);
}

/// Adds the time from its construction to its end to a sum.
class ScopedTimer
{
   public:
	explicit ScopedTimer(double& seconds) : seconds_(seconds) {}
	~ScopedTimer() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
	ScopedTimer(const ScopedTimer&) = delete;
	ScopedTimer& operator=(const ScopedTimer&) = delete;

   private:
	using Clock = std::chrono::steady_clock;
	double& seconds_;
	Clock::time_point start_ = Clock::now();
};

struct Job
{
	std::size_t frame = 0;
	mrpt::obs::CObservation2DRangeScan::ConstPtr scan;
	std::optional<Localization> result;
};

struct Item
{
	logs::RawlogObject object;
	std::size_t past_job = 0;  //!< [-] jobs of the batch up to here belong to this or earlier objects
};

struct Batch
{
	std::vector<Item> items;
	std::vector<Job> jobs;
};

/// Reads some objects of the log at a time, with the scans in them that are to be localized.
class BatchReader
{
   public:
	BatchReader(logs::LogReader& reader, const FrameSelection& selection, int threads)
	    : reader_(reader), selection_(selection), scans_per_batch_(kScansPerThread * static_cast<std::size_t>(threads))
	{
	}

	Batch read()
	{
		const ScopedTimer timer(seconds_);
		Batch batch;
		while (batch.jobs.size() < scans_per_batch_ && batch.items.size() < kMostObjects)
		{
			if (objects_ == selection_.objects) break;
			auto object = reader_.next();
			if (!object) break;
			objects_++;
			for (const auto& scan : object->scans)
			{
				if (scan->sensorLabel != selection_.label) continue;
				if (selection_.contains(scans_)) batch.jobs.push_back({scans_, scan, {}});
				scans_++;
			}
			object->scans.clear();
			object->object.reset();
			batch.items.push_back({std::move(*object), batch.jobs.size()});
		}
		return batch;
	}

	/// Returns the time [s] that reading took so far.
	double seconds() const { return seconds_; }

   private:
	logs::LogReader& reader_;
	FrameSelection selection_;
	std::size_t scans_per_batch_;
	std::size_t objects_ = 0;  //!< [-] objects read so far
	std::size_t scans_ = 0;    //!< [-] scans of the sensor seen so far
	double seconds_ = 0;
};

/// The odometry of a log, from one scan to the next.
class OdometryBetweenScans
{
   public:
	void add(const logs::RawlogObject& object)
	{
		has_news_ = has_news_ || object.odometry || object.increment;
		if (object.odometry) now_ = object.odometry;
		if (object.increment) now_ = now_.value_or(mrpt::poses::CPose2D()) + *object.increment;
	}

	/// Returns the increment since the last call, in the robot frame of that moment. There is none at the first call,
	/// if the increment is not plausible, or if no odometry came since the last call or between the two calls before.
	std::optional<mrpt::poses::CPose2D> take()
	{
		if (!std::exchange(has_news_, false)) now_.reset();  // no odometry is not the same as standing still
		std::optional<mrpt::poses::CPose2D> increment;
		if (now_ && then_) increment = *now_ - *then_;
		if (increment && !is_plausible(*increment))
		{
			increment.reset();
			now_.reset();
		}
		then_ = now_;
		return increment;
	}

   private:
	std::optional<mrpt::poses::CPose2D> now_;   //!< robot in the odometry's frame
	std::optional<mrpt::poses::CPose2D> then_;  //!< the same at the last scan
	bool has_news_ = false;                     //!< since the last scan
};

/// Takes what the scans of a batch say alone, follows them with the window and the fusion, and hands the frames on.
class Follower
{
   public:
	Follower(const Approach& approach, const FrameSink& sink) : approach_(approach), sink_(sink)
	{
		if (approach.window) window_.emplace(approach.localizer, *approach.window, approach.query.prior);
	}

	/// Follows the batch up to the first object with a scan that was not localized because of an interrupt.
	void follow(Batch& batch)
	{
		std::size_t job = 0;
		for (auto& item : batch.items)
		{
			for (std::size_t i = job; i < item.past_job; i++)
				if (!batch.jobs[i].result) return;
			odometry_.add(item.object);
			{
				const ScopedTimer timer(writing_seconds_);
				sink_.take_object(item.object);
			}
			for (; job < item.past_job; job++) follow(batch.jobs[job]);
		}
	}

	/// Returns the number of frames handed on so far.
	std::size_t frames() const { return frames_; }

	/// Returns the time [s] that the sink took so far.
	double writing_seconds() const { return writing_seconds_; }

   private:
	void follow(Job& job)
	{
		const auto motion = odometry_.take();
		const Localization& one_shot = *job.result;
		Frame frame{job.frame, seconds(*job.scan), one_shot};
		if (window_)
		{
			frame.alone = one_shot;
			frame.result = window_->add(make_scan(*job.scan, approach_.localizer.parameters().scan), one_shot, motion);
		}
		if (approach_.fusion_backend) frame.fused = approach_.fusion_backend->step({*job.scan, one_shot, motion});
		const ScopedTimer timer(writing_seconds_);
		sink_.take_frame(std::move(frame), std::move(job.scan));
		frames_++;
	}

	const Approach& approach_;
	const FrameSink& sink_;
	std::size_t frames_ = 0;
	double writing_seconds_ = 0;
	OdometryBetweenScans odometry_;
	std::optional<WindowLocalizer> window_;
};

/// Calls `work(i)` for every i below `count`, started in this order, on up to `threads` threads, the calling one
/// included. If the system refuses a thread, those there are do the work.
/// \throws what the first call of `work` to fail throws; calls that have not started by then are left out
void run_on_threads(std::size_t count, int threads, const std::function<void(std::size_t)>& work)
{
	std::atomic<std::size_t> next{0};
	std::exception_ptr failure;
	std::atomic_flag failed = ATOMIC_FLAG_INIT;
	const auto run = [&]
	{
		try
		{
			for (std::size_t i = next++; i < count; i = next++) work(i);
		}
		catch (...)
		{
			if (!failed.test_and_set()) failure = std::current_exception();
			next = count;
		}
	};
	std::vector<std::thread> others;
	others.reserve(static_cast<std::size_t>(threads));
	try
	{
		for (int i = 1; i < threads; i++) others.emplace_back(run);
	}
	catch (const std::system_error&)
	{
		// The system has a limit; the threads there are do the work.
	}
	run();
	for (std::thread& other : others) other.join();
	if (failure) std::rethrow_exception(failure);
}
}  // namespace

LoopResult localize_log(
    logs::LogReader& reader, const FrameSelection& selection, const Approach& approach, const FrameSink& sink,
    ProgressBar& progress)
{
	double seconds = 0;
	std::optional<ScopedTimer> timer(seconds);
	Follower follower(approach, sink);
	BatchReader batches(reader, selection, approach.threads);
	Batch previous, current = batches.read(), next;
	while (!current.items.empty() && !interrupted())
	{
		// Job 0 keeps the files, the window and the fusion busy while the other threads localize.
		const auto work = [&](std::size_t i)
		{
			if (i == 0)
			{
				follower.follow(previous);
				progress.show(follower.frames());
				next = batches.read();
			}
			else if (!interrupted())
				current.jobs[i - 1].result = approach.localizer.localize(*current.jobs[i - 1].scan, approach.query);
		};
		run_on_threads(1 + current.jobs.size(), approach.threads, work);
		previous = std::move(current);
		current = std::exchange(next, {});
	}
	follower.follow(previous);
	progress.show(follower.frames());
	timer.reset();
	// Reading and writing take one thread of those there are.
	seconds -= (batches.seconds() + follower.writing_seconds()) / approach.threads;
	return {reader.damage(), seconds};
}
}  // namespace d2s1r::app
