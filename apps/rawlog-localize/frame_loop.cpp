// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frame_loop.h"

#include "interrupt.h"
#include "window.h"

#include <d2s1r/parallel.h>

#include <utility>

namespace d2s1r::app
{
namespace
{
constexpr std::size_t kScansPerThread = 8;  //!< [-] in a batch
constexpr std::size_t kMostObjects = 1024;  //!< [-] in a batch: bounds the memory of logs with few scans

struct Job
{
	std::size_t frame = 0;
	mrpt::obs::CObservation2DRangeScan::ConstPtr scan;
	std::optional<Localization> result;
};

struct Item
{
	RawlogObject object;
	std::size_t past_job = 0;  //!< [-] jobs of the batch up to here belong to this or earlier objects
};

struct Batch
{
	std::vector<Item> items;
	std::vector<Job> jobs;
};

/// Some objects of the log at a time, with the scans that are to be localized.
class BatchReader
{
   public:
	BatchReader(const std::string& file, const FrameSelection& selection, int threads)
	    : reader_(file), selection_(selection), scans_per_batch_(kScansPerThread * static_cast<std::size_t>(threads))
	{
	}

	Batch read()
	{
		Batch batch;
		while (batch.jobs.size() < scans_per_batch_ && batch.items.size() < kMostObjects)
		{
			auto object = reader_.next();
			if (!object) break;
			for (const auto& scan : object->scans)
			{
				if (scan->sensorLabel != selection_.label) continue;
				if (scans_ >= selection_.first && scans_ < selection_.past) batch.jobs.push_back({scans_, scan, {}});
				scans_++;
			}
			object->scans.clear();
			batch.items.push_back({std::move(*object), batch.jobs.size()});
		}
		return batch;
	}

	const std::string& damage() const { return reader_.damage(); }

   private:
	RawlogReader reader_;
	FrameSelection selection_;
	std::size_t scans_per_batch_;
	std::size_t scans_ = 0;  //!< [-] scans of the sensor seen so far
};

/// Up to the first object with a scan that was not localized because of an interrupt.
void write(Batch& batch, std::optional<Window>& window, FrameOutputs& outputs)
{
	std::size_t job = 0;
	for (auto& item : batch.items)
	{
		for (std::size_t i = job; i < item.past_job; i++)
			if (!batch.jobs[i].result) return;
		if (window) window->add(item.object);
		outputs.add(item.object);
		for (; job < item.past_job; job++)
		{
			auto& [frame, scan, one_shot] = batch.jobs[job];
			Frame done{frame, seconds(*scan), window ? window->judge(*scan, *one_shot) : *one_shot};
			outputs.add(std::move(done), *one_shot, std::move(scan));
		}
	}
}
}  // namespace

std::string localize_rawlog(
    const std::string& file, const FrameSelection& selection, const Approach& approach, FrameOutputs& outputs,
    ProgressBar& progress)
{
	std::optional<Window> window;
	if (approach.window) window.emplace(approach.localizer, *approach.window, approach.query.prior);
	BatchReader reader(file, selection, approach.threads);
	Batch previous, current = reader.read(), next;
	while (!current.items.empty() && !interrupted())
	{
		// Job 0 keeps the files, and the window, busy while the other threads localize.
		parallel_for(
		    1 + current.jobs.size(), approach.threads,
		    [&](std::size_t i)
		    {
			    if (i == 0)
			    {
				    write(previous, window, outputs);
				    progress.show(outputs.frames().size());
				    next = reader.read();
			    }
			    else if (!interrupted())
				    current.jobs[i - 1].result = approach.localizer.localize(*current.jobs[i - 1].scan, approach.query);
		    });
		previous = std::move(current);
		current = std::exchange(next, {});
	}
	write(previous, window, outputs);
	progress.show(outputs.frames().size());
	return reader.damage();
}
}  // namespace d2s1r::app
