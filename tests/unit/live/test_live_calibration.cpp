// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Lasers and odometry that the messages describe wrongly: the drive through the map shows what is right.
#include <functional>

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
	explicit WanderingDrive(double yaw_error, const LiveSettings& given = {}, std::size_t start = 1)
	    : WanderingDrive(laser_at(0.1 + mrpt::DEG2RAD(yaw_error), 0), given, start)
	{
	}

	/// \param told pose of the laser on the robot by the messages
	explicit WanderingDrive(const mrpt::poses::CPose3D& told, const LiveSettings& given = {}, std::size_t start = 1)
	    : Drive(given)
	{
		robot.pose = mrpt::poses::CPose2D(poses_on_floor().at(start));
		add_map(grid);
		live.add_transforms({transform_of(robot.time, "base_link", "laser", told)}, true);
		live.set_tracker_readers(1, 1);
	}

	/// Returns the pose of the laser with another yaw and roll [rad].
	static mrpt::poses::CPose3D laser_at(double yaw, double roll)
	{
		const mrpt::poses::CPose3D laser = SimulatedRobot().laser_on_robot;
		return {laser.x(), laser.y(), laser.z(), yaw, 0, roll};
	}

	/// Lets a second laser be there, which is turned by 180 deg and whose transform is off by `yaw_error` [deg].
	void add_laser(double yaw_error)
	{
		has_other_laser = true;
		const auto told = laser_at(0.1 + M_PI + mrpt::DEG2RAD(yaw_error), 0);
		live.add_transforms({transform_of(robot.time, "base_link", "other", told)}, true);
	}

	/// Returns what the second laser sees.
	ros::LaserScan other_scan()
	{
		ros::LaserScan scan = robot.scan();
		scan.header.frame = "other";
		std::rotate(scan.ranges.begin(), scan.ranges.begin() + robot.beams / 2, scan.ranges.end());
		return scan;
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
			{
				turning_ = 60;
				if (std::exchange(has_driven_, false)) side_ = -side_;
			}
			robot.time += kSecond / 50;
			const double ahead = turning_ > 0 ? 0 : 0.01, turn = turning_ > 0 ? side_ * 0.02 : 0.002;
			turning_ -= turning_ > 0 ? 1 : 0;
			robot.move(ahead, turn);
			way += ahead, turned += std::abs(turn);
			has_driven_ = has_driven_ || ahead > 0;
			auto told = robot.odometry_transform();
			if (is_odometry_mirrored)
				told.front().pose = mrpt::poses::CPose3D(
				    mrpt::poses::CPose2D(robot.odometry.x(), -robot.odometry.y(), -robot.odometry.phi()));
			live.add_transforms(told, false);
			if (i % 5 != 0) continue;
			if (const auto pose = tracker.pose(robot.odometry))
				live.add_tracker_pose({robot.time, "map"}, mrpt::poses::CPose3D(*pose));
			ros::LaserScan scan = robot.scan();
			if (alter_scan) alter_scan(scan);
			live.add_scan("/scan", scan);
			if (has_other_laser) live.add_scan("/other_scan", other_scan());
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

	bool is_odometry_mirrored = false, has_other_laser = false;
	std::function<void(ros::LaserScan&)> alter_scan;  //!< into what the messages say; may be empty
	double way = 0, turned = 0;                       //!< [m], [rad]
	int right_seeds = 0, wrong_seeds = 0;             //!< after 1 m or 90 deg
	int right = 0, wrong = 0;                         //!< localized scans, after 1 m or 90 deg

   private:
	int turning_ = 0;
	double side_ = 1;
	bool has_driven_ = true;  //!< since it last turned on the spot
};
}  // namespace

TEST(LiveCalibration, OfALaserThatIsTurnedAgainstItsTransformLetsTheRightSeedWin)
{
	const std::vector<std::pair<double, std::size_t>> kDrives = {{180, 0}, {90, 1}, {45, 2}, {-20, 3}};
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

namespace
{
void mirror(ros::LaserScan& scan)
{
	std::reverse(scan.ranges.begin() + 1, scan.ranges.end());  // of a full turn from -180 deg on
}

void tell_in_degrees(ros::LaserScan& scan)
{
	for (float* angle : {&scan.first_angle, &scan.last_angle, &scan.angle_step})
		*angle *= 180 / static_cast<float>(M_PI);
}

/// Expects that the robot is found all the time after it has driven for some seconds, and never elsewhere.
void expect_found(WanderingDrive& drive, double seconds)
{
	drive.drive(seconds);
	EXPECT_EQ(drive.wrong, 0);
	EXPECT_EQ(drive.wrong_seeds, 0);
	drive.right = 0;
	drive.drive(3);
	EXPECT_GT(drive.right, 25) << testing::PrintToString(drive.news);
	ASSERT_TRUE(drive.tracker.map_to_odometry);
	EXPECT_LT(distance_between(*drive.tracker.pose(drive.robot.odometry), drive.robot.pose), 0.3);
}
}  // namespace

TEST(LiveCalibration, FindsScansThatFitByAnotherMountingOnly)
{
	WanderingDrive mirrored(0);
	mirrored.alter_scan = mirror;
	expect_found(mirrored, 12);
	EXPECT_TRUE(mirrored.was_told("scans are mirrored"));
	WanderingDrive upside_down(WanderingDrive::laser_at(0.1, M_PI));
	expect_found(upside_down, 12);
	EXPECT_TRUE(upside_down.was_told("scans are mirrored"));
	WanderingDrive on_its_side(WanderingDrive::laser_at(0.1, M_PI / 2));
	expect_found(on_its_side, 12);
	EXPECT_TRUE(on_its_side.was_told("laser is level, and not tilted"));
	WanderingDrive in_degrees(0);
	in_degrees.alter_scan = tell_in_degrees;
	expect_found(in_degrees, 12);
	EXPECT_TRUE(in_degrees.was_told("are in degrees"));
}

TEST(LiveCalibration, FindsNothingElseWhileTheRobotStands)
{
	WanderingDrive drive(0);
	drive.alter_scan = mirror;
	for (int i = 0; i < 100; i++)
	{
		drive.robot.time += kStep;
		ros::LaserScan scan = drive.robot.scan();
		mirror(scan);
		drive.live.add_transforms(drive.robot.odometry_transform(), false);
		drive.live.add_scan("/scan", scan);
		drive.update(drive.robot.time);
	}
	EXPECT_FALSE(drive.was_told("contradicts")) << "one place shows little";
}

TEST(LiveCalibration, CountsInTheMapOfAnAtlasThatTheRobotIsIn)
{
	LiveSettings settings;
	settings.has_maps_of_its_own = true;
	WanderingDrive drive(90, settings);
	Grid other = make_floor();
	std::reverse(other.cells.begin(), other.cells.end());
	for (int x = 0; x < other.width / 2; x++)
		for (int y = 0; y < other.height; y++)
			other.cells[static_cast<std::size_t>(other.index(x, y))] = Cell::kUnknown;
	std::vector<AtlasMap> maps;
	for (const auto& [name, grid] : {std::pair("map", make_floor()), std::pair("other", other)})
		maps.push_back({name, std::make_shared<const Localizer>(make_map(grid))});
	drive.live.use_maps(std::make_shared<Atlas>(maps));
	expect_found(drive, 10);
	EXPECT_TRUE(drive.was_told("yaw of the laser"));
}

TEST(LiveCalibration, OfMergedLasersTurnsEachAsTheDriveShows)
{
	LiveSettings settings;
	settings.merge_lasers = true;
	for (const auto& [of_used, of_other] : {std::pair(0., 90.), std::pair(180., 45.)})
	{
		SCOPED_TRACE(of_used);
		WanderingDrive drive(of_used, settings);
		drive.add_laser(of_other);
		expect_found(drive, 20);
		EXPECT_TRUE(drive.was_told("/other_scan: the drive contradicts")) << testing::PrintToString(drive.news);
	}
}
