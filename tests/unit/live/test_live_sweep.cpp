// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The scans of a robot that turns, whose laser takes one beam after the other.
#include <tuple>

#include "live/live_drive.h"

using namespace d2s1r;
using namespace d2s1r::test;
using namespace d2s1r::live;

namespace
{
/// Returns the mean error [deg] of the yaw of a robot that turns by 1 rad/s, whose laser takes 0.2 s for a scan.
double yaw_error_of_sweeps(const LiveSettings& settings, bool odometry_comes_by_tf)
{
	constexpr int kScans = 20;
	Drive drive(settings);
	drive.begin();
	double error = 0;
	int answers = 0;
	const auto tell = [&]
	{
		const auto transform = drive.robot.odometry_transform().front();
		if (odometry_comes_by_tf)
			drive.live.add_transforms({transform}, false);
		else
			drive.live.add_odometry({transform, {}});
	};
	tell();
	for (int i = 0; i < kScans; i++)
	{
		const mrpt::poses::CPose2D at_stamp = drive.robot.pose;
		const Time stamp = drive.robot.time;
		drive.live.add_scan("/scan", drive.robot.sweep(0.2, 0, 1, tell));
		const auto answer = drive.update(drive.robot.time);
		if (!answer || answer->localization.status != Status::kLocalized) continue;
		EXPECT_EQ(answer->time, stamp);
		error += turn_between(answer->localization.best().pose.asTPose(), at_stamp.asTPose());
		answers++;
	}
	EXPECT_GE(answers, kScans - 2);
	return error / answers;
}
}  // namespace

TEST(LiveLocalizer, MovesTheBeamsOfASweepToTheTimeOfTheScan)
{
	constexpr double kLeastTwist = 2;  // [deg] of beams that are not moved, which turn by 11 deg in all
	EXPECT_LT(yaw_error_of_sweeps({}, true), kLeastTwist / 4);
	EXPECT_LT(yaw_error_of_sweeps({}, false), kLeastTwist / 4);
	LiveSettings as_one;
	as_one.overrides.sweep = ros::SweepTime{};
	EXPECT_GT(yaw_error_of_sweeps(as_one, true), kLeastTwist);
}

namespace
{
/// A drive of a robot that turns by 1 rad/s, whose scans do not tell when their beams were taken.
struct UntoldDrive : Drive
{
	/// \param duration [s] of a sweep; 0: all beams are taken at once \param scan_time [s] of the messages
	UntoldDrive(double duration, float scan_time)
	{
		constexpr int kScans = 80, kLast = 20;
		begin();
		const auto tell = [&] { live.add_transforms(robot.odometry_transform(), false); };
		for (int i = 0; i < kScans; i++)
		{
			const mrpt::poses::CPose2D at_stamp = robot.pose;
			ros::LaserScan scan = duration > 0 ? robot.sweep(duration, 0, 1, tell) : robot.scan();
			if (duration == 0)
			{
				tell();
				robot.time += kSecond / 5;
				robot.move(0, 0.2);
				tell();
			}
			scan.time_step = 0;
			scan.scan_time = scan_time;
			live.add_scan("/scan", scan);
			const auto answer = update(robot.time);
			if (i < kScans - kLast || !answer || answer->localization.status != Status::kLocalized) continue;
			answers++;
			error += turn_between(answer->localization.best().pose.asTPose(), at_stamp.asTPose());
		}
		error /= std::max(answers, 1);
		EXPECT_GE(answers, kLast - 2);
	}

	int answers = 0;   //!< [-] to the last scans
	double error = 0;  //!< [deg] mean of their yaw
};
}  // namespace

TEST(LiveLocalizer, FindsOutByTheMapWhenTheBeamsOfASweepWereTaken)
{
	const UntoldDrive spins(0.2, 0.2F);
	EXPECT_LT(spins.error, 0.5);
	EXPECT_TRUE(spins.was_told("duration of the sweep")) << testing::PrintToString(spins.news);
	const UntoldDrive simulated(0, 0.2F);
	EXPECT_LT(simulated.error, 0.5);
	EXPECT_FALSE(simulated.was_told("contradicts")) << testing::PrintToString(simulated.news);
	const UntoldDrive untold(0.2, 0);
	EXPECT_LT(untold.error, 0.5) << "no scan_time is needed";
}

/// Simulators say so of scans whose beams they take at once.
TEST(LiveLocalizer, DoesNotWaitForTheEndOfASweepThatWouldLastBeyondItsMessage)
{
	for (const auto& [speed, scan_time, time_step] :
	     {std::tuple(0.0, 0.1F, 0.0F), std::tuple(0.2, 0.1F, 0.0F), std::tuple(0.0, 0.1F, 0.1F / 179),
	      std::tuple(0.2, 0.1F, 0.1F / 179)})
	{
		Drive drive;
		drive.begin();
		int right = 0;
		for (int i = 0; i < 40; i++)
		{
			for (int reading = 0; reading < 5; reading++)
			{
				drive.robot.time += kSecond / 50;
				drive.robot.move(speed / 50, 5 * speed / 50);
				drive.live.add_transforms(drive.robot.odometry_transform(), false);
				drive.update(drive.robot.time);
			}
			ros::LaserScan scan = drive.robot.scan();
			scan.scan_time = scan_time;
			scan.time_step = time_step;
			drive.live.add_scan("/scan", scan);
			const auto answer = drive.update(drive.robot.time);
			ASSERT_TRUE(answer && !answer->localization.hypotheses.empty())
			    << i << ' ' << speed << ' ' << time_step << drive.summary()
			    << (answer ? answer->scan.invalid_because : "");
			right += distance_between(answer->localization.best().pose, drive.robot.pose) < 0.1 ? 1 : 0;
		}
		EXPECT_EQ(right, 40) << speed << ' ' << time_step;
		for (const auto& [seed, truth] : drive.seeds) EXPECT_LT(distance_between(seed.pose, truth), 0.1);
	}
}

TEST(LiveLocalizer, NoticesByTheMapThatCloudsWereMovedToOneTimeBefore)
{
	LiveSettings settings;
	settings.cloud_height = ros::HeightBand{0, 1};
	Drive drive(settings);
	drive.begin();
	constexpr int kScans = 60, kLast = 10;
	double error = 0;
	int answers = 0;
	for (int i = 0; i < kScans; i++)
	{
		const ros::LaserScan scan = drive.robot.scan();
		const mrpt::poses::CPose2D at_stamp = drive.robot.pose;
		ros::PointCloud cloud{scan.header, {}};
		for (std::size_t beam = 0; beam < scan.ranges.size(); beam++)
		{
			const float angle = scan.first_angle + static_cast<float>(beam) * scan.angle_step,
			            range = scan.ranges[beam];
			const float time = 0.2F * static_cast<float>(beam) / static_cast<float>(scan.ranges.size() - 1);
			cloud.points.push_back({range * std::cos(angle), range * std::sin(angle), 0.2F, time});
		}
		for (int reading = 0; reading < 10; reading++)
		{
			drive.live.add_transforms(drive.robot.odometry_transform(), false);
			drive.robot.time += kSecond / 50;
			drive.robot.move(0, 0.02);
		}
		drive.live.add_transforms(drive.robot.odometry_transform(), false);
		drive.live.add_cloud("/points", cloud);
		const auto answer = drive.update(drive.robot.time);
		if (i < kScans - kLast || !answer || answer->localization.status != Status::kLocalized) continue;
		answers++;
		error += turn_between(answer->localization.best().pose.asTPose(), at_stamp.asTPose());
	}
	EXPECT_GE(answers, kLast - 1);
	EXPECT_LT(error / std::max(answers, 1), 0.5) << "[deg]; moved once more, the yaw is off by 5";
	EXPECT_TRUE(drive.was_told("duration of the sweep"));
}
