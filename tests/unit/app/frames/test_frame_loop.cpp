// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <mrpt/math/wrap2pi.h>
#include <mrpt/obs/CObservationOdometry.h>

#include <algorithm>
#include <chrono>
#include <sstream>
#include <thread>

#include "../temporary_folder.h"
#include "app_world.h"
#include "frames/frame_loop.h"
#include "mrpt_types.h"

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
		return localize_log(*reader, selection, {atlas_, {}, {}, false, nullptr, threads}, sink, progress);
	}

   private:
	const Atlas atlas_{std::vector<AtlasMap>{{"", std::make_shared<const Localizer>(test::make_map(test::flat()))}}};
};

TEST_F(FrameLoop, HandsOnEveryObjectAndBehindItTheFramesOfItsScans)
{
	for (const int threads : {1, 3})
	{
		std::string order;
		const FrameSink sink = {
		    [&](const logs::RawlogObject&) { order += "o"; },
		    [&](const Frame& frame, const Scan&, const ScanPtr& scan)
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
		    [](const logs::RawlogObject&) {}, [&](const Frame&, const Scan&, const ScanPtr&) { return ++frames < 4; }};
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
	    [](const Frame&, const Scan&, const ScanPtr&)
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

namespace
{
constexpr double kRate = 1.0;       // [rad/s] of the robot
constexpr double kSweep = 0.2;      // [s] of the laser for a turn
constexpr std::size_t kBeams = 90;  // [-] of a turn
/// Where a scan tells the rooms apart.
const mrpt::math::TPose2D kTurnsAt(6, 5, 0.3);

mrpt::math::TPose2D turning_robot(double time)
{
	return {kTurnsAt.x, kTurnsAt.y, kTurnsAt.phi + kRate * (time - test::kStartTime)};
}

/// A scan at `stamp` of a laser that takes its beams one after the other, from a robot that turns.
mrpt::obs::CObservation2DRangeScan::Ptr swept_scan(double stamp, const std::string& label)
{
	test::Laser laser;
	laser.beams = kBeams;
	laser.aperture = 2 * M_PI * (kBeams - 1) / kBeams;
	auto scan = std::make_shared<mrpt::obs::CObservation2DRangeScan>(
	    test::make_mrpt_observation(test::flat(), turning_robot(stamp), laser));
	for (std::size_t i = 0; i < kBeams; i++)
	{
		const auto at = turning_robot(stamp + kSweep * static_cast<double>(i) / kBeams);
		const auto then = test::make_mrpt_observation(test::flat(), at, laser);
		scan->setScanRange(i, then.getScanRange(i));
		scan->setScanRangeValidity(i, then.getScanRangeValidity(i));
	}
	scan->sensorLabel = label;
	scan->timestamp = logs::from_seconds(stamp);
	return scan;
}

/// A log of four scans of a robot that turns, each followed by the odometry of its time.
test::Objects turning_log()
{
	test::Objects objects;
	for (int i = 0; i < 4; i++)
	{
		const double stamp = test::kStartTime + 1 + i;
		objects.push_back(swept_scan(stamp, "LASER"));
		objects.push_back(swept_scan(stamp, "OTHER"));
		for (int k = 0; k < 50; k++)
		{
			const double time = stamp + 0.02 * k;
			auto reading = mrpt::obs::CObservationOdometry::Create();
			reading->timestamp = logs::from_seconds(time);
			reading->odometry = mrpt::poses::CPose2D(0, 0, turning_robot(time).phi);
			objects.push_back(reading);
		}
	}
	return objects;
}
}  // namespace

class TurningRobotOfALog : public test::FolderTest
{
   protected:
	/// Returns the log's frames.
	std::vector<Frame> frames_of(
	    const test::Objects& objects, const Approach& approach, const std::optional<logs::SweepTime>& sweep)
	{
		test::save(objects, path("in.rawlog"));
		std::vector<Frame> frames;
		const FrameSink sink = {
		    [](const logs::RawlogObject&) {},
		    [&](const Frame& frame, const Scan& scan, const ScanPtr& observation)
		    {
			    frames.push_back(frame);
			    scans_.push_back(scan);
			    observations_.push_back(observation);
			    return true;
		    }};
		Console console;
		ProgressBar progress(console, false, 0);
		logs::Overrides overrides;
		overrides.sweep = sweep;
		const auto reader = logs::read_log(logs::open_log(path("in.rawlog")), "LASER", overrides);
		localize_log(*reader, {"LASER", 0, 4, 1}, approach, sink, progress);
		return frames;
	}

	std::vector<Scan> scans_;            //!< that the sink got
	std::vector<ScanPtr> observations_;  //!< of these

	/// Returns the greatest error [rad] of the headings at the stamps.
	double greatest_error(const Approach& approach, const std::optional<logs::SweepTime>& sweep)
	{
		const auto frames = frames_of(turning_log(), approach, sweep);
		EXPECT_EQ(frames.size(), 4U);
		double greatest = 0;
		for (const Frame& frame : frames)
		{
			EXPECT_TRUE(frame.has_pose());
			EXPECT_TRUE(frame.localized() || !sweep);  // a twisted scan may fit nowhere
			if (!frame.has_pose()) continue;
			const double off = frame.result.best().pose.phi() - turning_robot(frame.timestamp).phi;
			greatest = std::max(greatest, std::abs(mrpt::math::wrapToPi(off)));
		}
		return greatest;
	}

	const Atlas atlas_{std::vector<AtlasMap>{{"", std::make_shared<const Localizer>(test::make_map(test::flat()))}}};
	const logs::SweepTime spin_ = {kSweep * (kBeams - 1) / kBeams, 0};
};

TEST_F(TurningRobotOfALog, PoseIsThatOfTheStampByTheOdometryBetweenTheBeams)
{
	EXPECT_GT(greatest_error({atlas_, {}, {}, false, nullptr, 1}, {}), 0.06);
	for (const int threads : {1, 2})
	{
		Approach moved = {atlas_, {}, {}, false, nullptr, threads};
		EXPECT_LT(greatest_error(moved, spin_), 0.02);
		moved.window = 3;
		EXPECT_LT(greatest_error(moved, spin_), 0.02);
		moved.merge_lasers = true;
		EXPECT_LT(greatest_error(moved, spin_), 0.04) << "the other laser's scans are taken as the log says, at once";
	}
}

TEST_F(TurningRobotOfALog, AnswersThatAreThereAreNotSearchedAgain)
{
	Localization known;
	known.status = Status::kRejected;
	known.note = "answered before";
	const std::map<std::size_t, Localization> answers = {{2, known}};
	for (const int threads : {1, 2})
	{
		Approach approach = {atlas_, {}, {}, false, nullptr, threads};
		approach.answers = &answers;
		const auto frames = frames_of(turning_log(), approach, spin_);
		ASSERT_EQ(frames.size(), 4U);
		for (const Frame& frame : frames) EXPECT_EQ(frame.result.note == known.note, frame.index == 2);
	}
}

/// Nobody tells the motion, so that the scan stays twisted: what is called localized must be right within its
/// deviation.
TEST_F(TurningRobotOfALog, WithoutOdometryTheStandardDeviationTellsTheMotion)
{
	test::Objects scans;
	for (const auto& object : turning_log())
		if (std::dynamic_pointer_cast<mrpt::obs::CObservation2DRangeScan>(object)) scans.push_back(object);
	const auto frames = frames_of(scans, {atlas_, {}, {}, false, nullptr, 1}, spin_);
	ASSERT_EQ(frames.size(), 4U);
	for (const Frame& frame : frames)
	{
		if (!frame.localized()) continue;
		const Hypothesis& best = frame.result.best();
		const double off = std::abs(mrpt::math::wrapToPi(best.pose.phi() - turning_robot(frame.timestamp).phi));
		EXPECT_LT(off, 3 * std::sqrt(best.covariance(2, 2))) << frame.index << ' ' << frame.result.confidence;
		EXPECT_GT(std::sqrt(best.covariance(2, 2)), 0.03) << "0.2 s at 1 rad/s";
	}
}

TEST_F(TurningRobotOfALog, TheSinkGetsTheScanThatWasLocalized)
{
	frames_of(turning_log(), {atlas_, {}, {}, false, nullptr, 1}, spin_);
	ASSERT_EQ(scans_.size(), 4U);
	const double stamp = test::kStartTime + 1;
	test::Laser laser;
	laser.beams = 1440;
	laser.aperture = 2 * M_PI * 1439 / 1440;
	const Scan at_once = make_scan(test::make_observation(test::flat(), turning_robot(stamp), laser), {});
	const auto share_seen_at_once = [&](const Scan& scan)
	{
		std::size_t seen = 0;
		for (const Beam& beam : scan.beams)
		{
			const auto nearest = std::min_element(
			    at_once.beams.begin(), at_once.beams.end(),
			    [&](const Beam& a, const Beam& b)
			    { return std::abs(a.angle - beam.angle) < std::abs(b.angle - beam.angle); });
			seen += std::abs(nearest->range - beam.range) < 0.1F;
		}
		return static_cast<double>(seen) / static_cast<double>(scan.beams.size());
	};
	EXPECT_LT(share_seen_at_once(make_scan(d2s1r::scan_of(*swept_scan(stamp, "LASER")), {})), 0.7);
	EXPECT_GT(share_seen_at_once(scans_[0]), 0.9);
	EXPECT_GT(share_seen_at_once(make_scan(*observations_[0], {})), 0.75) << "directions are rounded to 4 deg";
}

namespace
{
constexpr int kCircleScans = 40;

/// Returns where a robot is that drives a circle.
mrpt::math::TPose2D circling_robot(std::size_t scan)
{
	const double angle = 0.5 * static_cast<double>(scan), phi = mrpt::math::wrapToPi(angle + M_PI / 2);
	return {kTurnsAt.x + 0.6 * std::cos(angle), kTurnsAt.y + 0.6 * std::sin(angle), phi};
}

/// Returns its log, once a second.
/// \param yaw_error [rad] of what it says of the laser
test::Objects circling_log(double yaw_error, bool is_odometry_mirrored)
{
	test::Objects objects;
	for (std::size_t i = 0; i < kCircleScans; i++)
	{
		const mrpt::math::TPose2D robot = circling_robot(i);
		const double side = is_odometry_mirrored ? -1 : 1;
		auto reading = mrpt::obs::CObservationOdometry::Create();
		reading->odometry = mrpt::poses::CPose2D(robot.x, side * robot.y, side * robot.phi);
		auto scan =
		    std::make_shared<mrpt::obs::CObservation2DRangeScan>(test::make_mrpt_observation(test::flat(), robot));
		scan->sensorPose = scan->sensorPose + mrpt::poses::CPose3D(0, 0, 0, yaw_error, 0, 0);
		scan->sensorLabel = "LASER";
		reading->timestamp = scan->timestamp = logs::from_seconds(test::kStartTime + static_cast<double>(i));
		objects.push_back(reading);
		objects.push_back(scan);
	}
	return objects;
}
}  // namespace

TEST_F(TurningRobotOfALog, TheDriveThatALogShowsOnTheWayCorrectsLaserAndOdometry)
{
	for (const bool is_odometry_mirrored : {false, true})
		for (const int threads : {1, 2})
		{
			test::save(circling_log(is_odometry_mirrored ? 0 : M_PI / 2, is_odometry_mirrored), path("in.rawlog"));
			int late_right = 0, late_wrong = 0;
			std::vector<std::string> told;
			FrameSink sink;
			sink.take_object = [](const logs::RawlogObject&) {};
			sink.tell = [&](const std::string& line) { told.push_back(line); };
			sink.take_frame = [&](const Frame& frame, const Scan&, const ScanPtr&)
			{
				if (!frame.localized()) return true;
				const auto off = frame.result.best().pose.asTPose() - circling_robot(frame.index);
				const bool is_right = std::abs(mrpt::math::wrapToPi(off.phi)) < 0.05 && std::hypot(off.x, off.y) < 0.1;
				if (frame.index >= kCircleScans / 2) (is_right ? late_right : late_wrong)++;
				return true;
			};
			Console console;
			ProgressBar progress(console, false, 0);
			Approach approach{atlas_, {}, {}, false, nullptr, threads};
			approach.calibrates = true;
			const auto reader = logs::read_log(logs::open_log(path("in.rawlog")), "LASER", {});
			localize_log(*reader, {"LASER", 0, kCircleScans, 1}, approach, sink, progress);
			const std::string what = is_odometry_mirrored ? "odometry mirrored" : "yaw of the laser";
			const auto is_of_it = [&](const std::string& line) { return line.find(what) != std::string::npos; };
			EXPECT_EQ(std::count_if(told.begin(), told.end(), is_of_it), 1) << testing::PrintToString(told);
			EXPECT_EQ(late_wrong, 0) << threads;
			EXPECT_GE(late_right, 12) << threads;
		}
}
