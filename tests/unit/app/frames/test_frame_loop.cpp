// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/frame_loop.h"

#include "../temporary_folder.h"
#include "app_world.h"

#include <chrono>
#include <sstream>
#include <thread>

using namespace d2s1r;
using namespace d2s1r::app;

class FrameLoop : public test::FolderTest
{
   protected:
	FrameLoop() { test::save(test::observation_log(), path("in.rawlog")); }

	LoopResult run(const FrameSelection& selection, int threads, const FrameSink& sink)
	{
		Console console;
		ProgressBar progress(console, false, 0);
		const auto reader = logs::open_log(path("in.rawlog")).read();
		return localize_log(*reader, selection, {localizer_, {}, {}, nullptr, threads}, sink, progress);
	}

   private:
	Localizer localizer_{test::make_map(test::flat())};
};

TEST_F(FrameLoop, HandsOnEveryObjectAndBehindItTheFramesOfItsScans)
{
	for (const int threads : {1, 3})
	{
		std::string order;
		const FrameSink sink = {
		    [&](const logs::RawlogObject&) { order += "o"; },
		    [&](const Frame& frame, const mrpt::obs::CObservation2DRangeScan::ConstPtr& scan)
		    {
			    order += std::to_string(frame.index) + " ";
			    EXPECT_NEAR(frame.timestamp, test::walk_time(frame.index), 1e-6);
			    EXPECT_TRUE(scan);
			    return true;
		    }};
		EXPECT_EQ(run({"LASER", 1, 9, 3}, threads, sink).damage, "");
		EXPECT_EQ(order, "oo1 ooo4 ooo7 oooo") << threads;
	}
}

TEST_F(FrameLoop, EndsWhenTheSinkWantsNoMore)
{
	for (const int threads : {1, 3})
	{
		std::size_t frames = 0;
		const FrameSink sink = {
		    [](const logs::RawlogObject&) {},
		    [&](const Frame&, const mrpt::obs::CObservation2DRangeScan::ConstPtr&) { return ++frames < 4; }};
		const LoopResult result = run({"LASER", 0, 12, 1}, threads, sink);
		EXPECT_TRUE(result.is_enough);
		EXPECT_EQ(result.frames, 4U) << threads;
		EXPECT_EQ(frames, 4U) << threads;
	}
}

TEST_F(FrameLoop, TheTimeOfTheSinkDoesNotCount)
{
	static constexpr double kSinkSeconds = 0.02;  // [s] for each of 12 frames
	const FrameSink sink = {
	    [](const logs::RawlogObject&) {},
	    [](const Frame&, const mrpt::obs::CObservation2DRangeScan::ConstPtr&)
	    {
		    std::this_thread::sleep_for(std::chrono::duration<double>(kSinkSeconds));
		    return true;
	    }};
	const auto start = std::chrono::steady_clock::now();
	const double seconds = run({"LASER", 0, 12, 1}, 1, sink).seconds;
	const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
	EXPECT_GT(seconds, 0);
	EXPECT_LT(seconds, wall - 12 * kSinkSeconds);
}
