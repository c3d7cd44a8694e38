// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Lasers and odometry that the messages describe wrongly: the drive through the map shows what is right.
#include "live/live_drive.h"

using namespace d2s1r;
using namespace d2s1r::test;
using namespace d2s1r::live;

namespace
{
/// A robot that drives ahead and turns on the spot where a wall is near, with odometry 50 times a second.
struct WanderingDrive : Drive
{
	/// \param yaw_error [deg] of the laser's transform
	explicit WanderingDrive(double yaw_error, const LiveSettings& given = {}, std::size_t start = 1) : Drive(given)
	{
		robot.pose = mrpt::poses::CPose2D(poses_on_floor().at(start));
		add_map(grid);
		const auto& laser = robot.laser_on_robot;
		const mrpt::poses::CPose3D told(
		    laser.x(), laser.y(), laser.z(), 0.1 + mrpt::DEG2RAD(yaw_error), 0, 0);  // CPose3D computes in place
		live.add_transforms({transform_of(robot.time, "base_link", "laser", told)}, true);
		live.set_tracker_readers(1, 1);
	}

	/// Drives for some seconds.
	void drive(double seconds)
	{
		const int steps = static_cast<int>(std::lround(50 * seconds));
		for (int i = 0; i < steps; i++)
		{
			const auto is_near = [&](double angle)
			{ return cast_exactly(robot.world, robot.pose.x(), robot.pose.y(), robot.pose.phi() + angle, 1) < 0.8; };
			if (turning_ == 0 && (is_near(-0.6) || is_near(-0.3) || is_near(0) || is_near(0.3) || is_near(0.6)))
				turning_ = 60, side_ = -side_;
			robot.time += kSecond / 50;
			const double ahead = turning_ > 0 ? 0 : 0.01, turn = turning_ > 0 ? side_ * 0.02 : 0.002;
			turning_ -= turning_ > 0 ? 1 : 0;
			robot.move(ahead, turn);
			way += ahead, turned += std::abs(turn);
			auto told = robot.odometry_transform();
			if (is_odometry_mirrored)
				told.front().pose = mrpt::poses::CPose3D(
				    mrpt::poses::CPose2D(robot.odometry.x(), -robot.odometry.y(), -robot.odometry.phi()));
			live.add_transforms(told, false);
			if (i % 5 != 0) continue;
			if (const auto pose = tracker.pose(robot.odometry))
				live.add_tracker_pose({robot.time, "map"}, mrpt::poses::CPose3D(*pose));
			live.add_scan("/scan", robot.scan());
			const std::size_t before = seeds.size();
			const auto answer = update(robot.time);
			const auto is_right = [&](const mrpt::poses::CPose2D& pose) {
				return distance_between(pose, robot.pose) < 0.3 &&
				       turn_between(pose.asTPose(), robot.pose.asTPose()) < 5;
			};
			const bool counts = way > 1 || turned > M_PI / 2;
			if (seeds.size() > before && counts) (is_right(seeds.back().first.pose) ? right_seeds : wrong_seeds)++;
			if (answer && answer->localization.status == Status::kLocalized && counts)
				(is_right(answer->localization.best().pose) ? right : wrong)++;
		}
	}

	bool is_odometry_mirrored = false;
	double way = 0, turned = 0;            //!< [m], [rad]
	int right_seeds = 0, wrong_seeds = 0;  //!< after 1 m or 90 deg
	int right = 0, wrong = 0;              //!< localized scans, after 1 m or 90 deg

   private:
	int turning_ = 0;
	double side_ = 1;
};
}  // namespace

TEST(LiveCalibration, OfALaserThatIsTurnedAgainstItsTransformLetsTheRightSeedWin)
{
	const std::vector<std::pair<double, std::size_t>> kDrives = {{180, 0}, {90, 1}, {45, 2}, {-20, 5}};
	for (const auto& [yaw_error, start] : kDrives)
	{
		SCOPED_TRACE(yaw_error);
		WanderingDrive drive(yaw_error, {}, start);
		drive.drive(10);
		EXPECT_EQ(drive.wrong_seeds, 0) << "after 1 m or 90 deg";
		EXPECT_GT(drive.right, 5 * drive.wrong);
		ASSERT_TRUE(drive.tracker.map_to_odometry);
		EXPECT_LT(distance_between(*drive.tracker.pose(drive.robot.odometry), drive.robot.pose), 0.3);
		EXPECT_LT(turn_between(drive.tracker.pose(drive.robot.odometry)->asTPose(), drive.robot.pose.asTPose()), 5);
		EXPECT_TRUE(drive.was_told("yaw of the laser")) << testing::PrintToString(drive.news);
	}
}

TEST(LiveCalibration, ChangesNothingThatTheMessagesSayRightly)
{
	for (const Seeding seeding : {Seeding::kOnce, Seeding::kWatch})
	{
		WanderingDrive drive(0, watching(seeding));
		drive.drive(30);
		EXPECT_EQ(drive.seeds.size(), 1U);
		EXPECT_EQ(drive.wrong, 0);
		EXPECT_FALSE(drive.was_told("contradicts")) << testing::PrintToString(drive.news);
	}
}

TEST(LiveCalibration, BelievesTheMessagesIfItIsToldSo)
{
	LiveSettings settings;
	settings.as_told = true;
	WanderingDrive drive(90, settings);
	drive.drive(10);
	EXPECT_FALSE(drive.was_told("contradicts"));
	EXPECT_GT(drive.wrong, 10);
	EXPECT_EQ(drive.right, 0);
}

TEST(LiveCalibration, OfMirroredOdometryTurnsItRound)
{
	WanderingDrive drive(0);
	drive.is_odometry_mirrored = true;
	drive.drive(20);
	EXPECT_EQ(drive.wrong, 0);
	EXPECT_TRUE(drive.was_told("odometry mirrored")) << testing::PrintToString(drive.news);
	drive.right = 0;
	drive.drive(2);
	EXPECT_GT(drive.right, 15);
}
