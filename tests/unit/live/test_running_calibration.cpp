// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What a running robot's messages, and its scans that are found or missed, say of its lasers.
#include <live_robot.h>

#include <cmath>
#include <functional>

#include "live/live_drive.h"

using namespace d2s1r;
using namespace d2s1r::test;
using namespace d2s1r::live;
using mrpt::poses::CPose2D;
using mrpt::poses::CPose3D;

namespace
{
/// A robot that drives in circles, now fast and now slowly, whose scans a calibration takes as found or missed.
struct CircleDrive
{
	explicit CircleDrive(const ros::Overrides& given = {}, bool is_odometry_known = false)
	    : calibration(given, true, is_odometry_known)
	{
		robot.world = world_of(map);
		robot.pose = CPose2D(poses_on_floor().at(4));
		robot.laser_on_robot = CPose3D(0.2, 0.05, 0.3, 0.1, 0, 0);
		told = robot.laser_on_robot;
	}

	/// Drives on, and returns what the laser sees.
	ros::UncalibratedScan next()
	{
		for (int i = 0; i < 40; i++)
		{
			robot.time += kSecond / 50;
			robot.move(0.006, 0.03 + 0.02 * std::sin(0.031 * steps++));
			const auto time =
			    robot.time + static_cast<Time>(1e9 * (odometry_clock - calibration.in_use().odometry_clock));
			const CPose2D odometry(
			    robot.odometry.x(), is_mirrored ? -robot.odometry.y() : robot.odometry.y(),
			    is_mirrored ? -robot.odometry.phi() : robot.odometry.phi());
			last = ros::odometry_as(calibration.in_use(), odometry);
			readings.emplace_back(time, last.asTPose());
		}
		calibration.follow(robot.time, last);
		return {robot.time, ros::to_scan(robot.scan(), told), told, {}};
	}

	bool find()
	{
		const auto scan = next();
		const auto before = ros::entries_of(calibration.in_use());
		const bool is_other = calibration.add(map, scan, robot.pose.asTPose(), readings);
		if (ros::entries_of(calibration.in_use()) != before) readings.clear();
		return is_other;
	}

	/// \return how many scans were searched
	int miss(const std::function<bool(const RangeScan&)>& is_found)
	{
		int searched = 0;
		calibration.miss(next(), [&](const RangeScan& scan, const Sweep&) { return searched++, is_found(scan); });
		return searched;
	}

	Grid map = make_floor();
	SimulatedRobot robot;
	ros::RunningCalibration calibration;
	ros::RunningCalibration::Readings readings;
	CPose3D told;  //!< pose of the laser by the messages
	CPose2D last;  //!< by the odometry in use
	int steps = 0;
	bool is_mirrored = false;   //!< whether the odometry is
	double odometry_clock = 0;  //!< [s]
};

bool is_never_found(const RangeScan&)
{
	return false;
}

bool is_upside_down(const RangeScan& scan)
{
	return scan.sensor_on_robot.getRotationMatrix()(2, 2) < 0;
}
}  // namespace

TEST(RunningCalibration, BelievesAGivenPoseWhateverTfSays)
{
	ros::Overrides given;
	given.sensor_pose = CPose3D(0.2, 0.05, 0.3, 0.1, 0, 0);
	CircleDrive drive(given);
	for (int i = 0; i < 7; i++)
	{
		const auto scan = drive.next();
		EXPECT_TRUE(drive.calibration.wants(scan.time)) << i;
		auto elsewhere = scan;
		elsewhere.laser = CPose3D(0.1 * i, 0, 0, 0, 0, 0);
		drive.calibration.add(drive.map, elsewhere, drive.robot.pose.asTPose(), drive.readings);
	}
	EXPECT_TRUE(drive.calibration.is_confirmed());
}

TEST(RunningCalibration, BeginsAnewWithALaserThatIsElsewhere)
{
	CircleDrive drive;
	for (int i = 0; i < 4; i++) EXPECT_FALSE(drive.find()) << i;
	drive.robot.laser_on_robot = drive.told = CPose3D(-0.3, 0, 0.3, 0, 0, 0);
	for (int i = 0; i < 4; i++) EXPECT_FALSE(drive.find()) << i;
	EXPECT_FALSE(drive.calibration.is_contradicted());
}

TEST(RunningCalibration, CorrectsASmallShiftWithoutScansThatAreReadAnew)
{
	for (const double shift : {0.07, 0.2})
	{
		CircleDrive drive;
		drive.told = CPose3D(shift, 0, 0, 0, 0, 0) + drive.robot.laser_on_robot;
		bool is_other = false;
		for (int i = 0; i < 20; i++) is_other = drive.find() || is_other;
		ASSERT_TRUE(drive.calibration.in_use().sensor_pose) << shift;
		EXPECT_NEAR(drive.calibration.in_use().sensor_pose->x(), 0.2, 0.02) << shift;
		EXPECT_EQ(is_other, shift > 0.1) << shift;
	}
}

TEST(RunningCalibration, StaysOpenIfALaserIsElsewhereThatTheDriveContradicted)
{
	CircleDrive drive({}, true);
	drive.is_mirrored = true;
	for (int i = 0; i < 12; i++) drive.find();
	ASSERT_TRUE(drive.calibration.is_contradicted());
	drive.robot.laser_on_robot = drive.told = CPose3D(-0.3, 0, 0.3, 0, 0, 0);
	drive.find();
	EXPECT_TRUE(drive.calibration.is_open());
}

TEST(RunningCalibration, TriesNoOtherMountingOfALaserThatTheDriveConfirms)
{
	CircleDrive drive;
	for (int i = 0; i < 5; i++) drive.find();
	ASSERT_TRUE(drive.calibration.is_confirmed());
	for (int i = 0; i < 70; i++) EXPECT_EQ(drive.miss(is_never_found), 0) << i;
}

TEST(RunningCalibration, TriesOneMountingAtATime)
{
	CircleDrive drive;
	drive.told = CPose3D(0.2, 0.05, 0.3, 0.1, 0, M_PI / 2);  // which may be mounted in several ways
	int searched = 0;
	for (int i = 0; i < 70; i++)
	{
		const int now = drive.miss(is_never_found);
		EXPECT_LE(now, 16) << "a mounting, by the scans that were missed";
		searched += now;
	}
	EXPECT_GT(searched, 24);
	EXPECT_FALSE(drive.calibration.in_use().sensor_pose);
	CircleDrive found;
	for (int i = 0; i < 20; i++) found.miss(is_upside_down);
	EXPECT_TRUE(found.calibration.in_use().sensor_pose);
}

TEST(RunningCalibration, KeepsWhatItShowedOfTheOdometryWhenTheLaserIsReadOtherwise)
{
	CircleDrive drive;
	drive.is_mirrored = true;
	for (int i = 0; i < 12; i++) drive.find();
	ASSERT_TRUE(drive.calibration.in_use().is_odometry_mirrored);
	drive.told = CPose3D(0.3, 0, 0.3, 0, 0, 0);
	for (int i = 0; i < 20; i++) drive.miss(is_upside_down);
	EXPECT_TRUE(drive.calibration.in_use().sensor_pose);
	EXPECT_TRUE(drive.calibration.in_use().is_odometry_mirrored) << "or the readings that have come are of neither";
}

TEST(RunningCalibration, LeavesTheOdometryToTheLaserInUse)
{
	CircleDrive first, other({}, true);
	for (CircleDrive* drive : {&first, &other})
	{
		drive->odometry_clock = -1;
		int changes = 0;
		for (int i = 0; i < 50; i++) changes += drive->find() ? 1 : 0;
		EXPECT_EQ(changes, 1) << "once for all";
		EXPECT_TRUE(drive->calibration.is_confirmed());
	}
	EXPECT_NEAR(first.calibration.in_use().odometry_clock, -1, 0.05);
	EXPECT_EQ(other.calibration.in_use().odometry_clock, 0);
	ASSERT_TRUE(other.calibration.in_use().sweep);
	EXPECT_NEAR(other.calibration.in_use().sweep->first_beam, -1, 0.05) << "the clock of the laser is another one";
}

TEST(LiveRobot, TakesTheGivenSweepForMergedLasersToo)
{
	LiveSettings settings;
	settings.merge_lasers = true;
	settings.overrides.sweep = ros::SweepTime{0.2, 0};
	LiveRobot robot(settings);
	SimulatedRobot simulated;
	simulated.world = world_of(make_floor());
	simulated.pose = CPose2D(poses_on_floor().at(4));
	robot.add_transforms(simulated.laser_transform(), true, 1);
	robot.add_transforms(simulated.odometry_transform(), false, 1);
	for (const char* topic : {"/scan", "/other_scan"})
	{
		const ros::LaserScan scan = simulated.scan();
		const WaitingScan waiting{topic, scan.header, scan};
		robot.look_at(waiting);
		const auto read = robot.read(waiting);
		ASSERT_TRUE(read);
		EXPECT_NEAR(read->placed.sweep.beam_step, 0.2 / (simulated.beams - 1), 1e-9) << topic;
	}
}
