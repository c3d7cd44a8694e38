// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/calibration.h>
#include <gtest/gtest.h>

#include "simulated_drive.h"

namespace d2s1r::test
{
namespace
{
using calibration::Calibration;
using calibration::Reading;
using calibration::Verdict;

/// Returns what a drive shows whose messages say that the laser is in the middle and takes all beams at once.
Calibration calibrate_drive(const DriveSettings& settings, const calibration::Given& given = {})
{
	const Grid map = make_floor();
	SimulatedDrive drive = simulate_drive(map, settings);
	std::mt19937 random(7);
	std::normal_distribution<double> normal;
	for (calibration::FoundScan& scan : drive.scans)
		scan.laser =
		    scan.laser + mrpt::math::TPose2D(0.02 * normal(random), 0.02 * normal(random), 0.01 * normal(random));
	return calibration::calibrate(map, {}, drive.scans, drive.odometry, given);
}

TEST(Calibration, ChangesNothingThatIsRight)
{
	for (unsigned seed = 1; seed <= 4; seed++)
	{
		DriveSettings settings;
		settings.seed = seed;
		EXPECT_FALSE(calibrate_drive(settings).is_changed()) << seed;
	}
}

TEST(Calibration, ConfirmsMessagesThatAreRightAndNoOthers)
{
	int confirmed = 0;
	for (unsigned seed = 1; seed <= 3; seed++)
	{
		DriveSettings settings;
		settings.seed = seed;
		confirmed += calibrate_drive(settings).is_confirmed;
		settings.truth.start = 0.06;
		EXPECT_FALSE(calibrate_drive(settings).is_confirmed) << seed;
		settings.truth.start = 0;
		settings.truth.laser.phi = 4 * kDegree;
		EXPECT_FALSE(calibrate_drive(settings).is_confirmed) << seed;
	}
	EXPECT_EQ(confirmed, 3);
}

TEST(Calibration, FollowsScansAsLongAsTheMessagesLeadToWalls)
{
	const Grid map = make_floor();
	DriveSettings settings;
	settings.period = 0.5;
	const SimulatedDrive drive = simulate_drive(map, settings);
	std::vector<calibration::FoundScan> scans = drive.scans;
	for (std::size_t i = 1; i < scans.size(); i++) scans[i].is_found = false, scans[i].laser = {};
	const auto followed = calibration::follow(map, {}, scans, drive.odometry);
	ASSERT_EQ(followed.size(), scans.size());
	for (std::size_t i = 0; i < followed.size(); i++)
	{
		const auto off = followed[i].laser - drive.scans[i].laser;
		EXPECT_LT(std::hypot(off.x, off.y), 0.06) << i;
		EXPECT_LT(std::abs(off.phi), 0.02) << i;
	}
	EXPECT_TRUE(calibration::calibrate(map, {}, followed, drive.odometry).is_confirmed);
	Reading turned;
	turned.laser.phi = 180 * kDegree;
	EXPECT_TRUE(calibration::follow(map, turned, scans, drive.odometry).empty());
	scans.back().is_found = true;  // elsewhere
	scans.back().laser = drive.scans.back().laser + mrpt::math::TPose2D(1, 0, 0);
	EXPECT_TRUE(calibration::follow(map, {}, scans, drive.odometry).empty());
}

TEST(Calibration, FindsALaserThatIsTurnedAndLate)
{
	DriveSettings settings;
	settings.truth.laser = {0.3, -0.2, 90 * kDegree};
	settings.truth.start = -0.1;
	settings.truth.duration = 0.1;
	const Calibration result = calibrate_drive(settings);
	EXPECT_NEAR(result.shown.laser.phi, 90 * kDegree, 1 * kDegree);
	EXPECT_NEAR(result.shown.start, -0.1, 0.02);
	EXPECT_NEAR(result.shown.duration, 0.1, 0.02);
}

TEST(Calibration, FindsMirroredOdometryInAnotherClock)
{
	DriveSettings settings;
	settings.truth.is_odometry_mirrored = true;
	settings.truth.odometry_clock = 3;
	const Calibration result = calibrate_drive(settings);
	EXPECT_TRUE(result.shown.is_odometry_mirrored);
	EXPECT_NEAR(result.shown.odometry_clock, 3, 0.03);
	calibration::Given given;
	given.is_odometry_known = true;
	const Calibration held = calibrate_drive(settings, given);
	EXPECT_FALSE(held.shown.is_odometry_mirrored);
	EXPECT_EQ(held.shown.odometry_clock, 0);
}

TEST(Calibration, TakesOdometryThatHasTheTimesOfTheScansForOneOfTheirClock)
{
	DriveSettings settings;
	settings.truth.odometry_clock = 0.4;
	EXPECT_NEAR(calibrate_drive(settings).shown.odometry_clock, 0.4, 0.03);
	calibration::Given given;
	for (double time = 0; time < 100; time += 0.02) given.stamps.push_back(time + 0.4);
	EXPECT_EQ(calibrate_drive(settings, given).shown.odometry_clock, 0);
	given.stamps.erase(given.stamps.begin(), given.stamps.begin() + 2250);  // 45 s of 60
	EXPECT_EQ(calibrate_drive(settings, given).shown.odometry_clock, 0) << "the last stamps are enough";
}

TEST(Calibration, FindsTheUnitOfWaysByMoreThanAFewMotions)
{
	DriveSettings settings;
	settings.truth.way_scale = 100;
	SimulatedDrive drive = simulate_drive(make_floor(), settings);
	EXPECT_TRUE(calibration::agreement_of({}, drive.scans, drive.odometry).is_confirmed());
	EXPECT_NEAR(calibrate_drive(settings).shown.way_scale, 100, 3);
	settings.truth.way_scale = 1;
	settings.speed = 0.2;
	drive = simulate_drive(make_floor(), settings);
	drive.scans.resize(2);
	drive.scans[1].laser = drive.scans[0].laser + mrpt::math::TPose2D(2, 0.5, 0.1);
	EXPECT_FALSE(calibration::agreement_of({}, drive.scans, drive.odometry).is_shown) << "carried";
}

TEST(Calibration, AgreesWithADriveOrContradictsItAfterAFewScans)
{
	DriveSettings settings;
	settings.seconds = 8;
	SimulatedDrive drive = simulate_drive(make_floor(), settings);
	const auto agreement = [&](double yaw)
	{
		Reading reading;
		reading.laser.phi = yaw;
		return calibration::agreement_of(reading, drive.scans, drive.odometry);
	};
	EXPECT_TRUE(agreement(0).is_confirmed());
	const auto beside = agreement(45 * kDegree).covariance;
	EXPECT_GT(std::sqrt(beside(2, 2)), 40 * kDegree) << "the poses may be off by that";
	EXPECT_LT(std::sqrt(agreement(0).covariance(2, 2)), 5 * kDegree);
	for (const double yaw : {180 * kDegree, -90 * kDegree, 45 * kDegree})
		EXPECT_TRUE(agreement(yaw).is_contradicted) << yaw;
	for (calibration::FoundScan& scan : drive.scans) scan.laser.x += 10 * scan.time;
	EXPECT_FALSE(agreement(180 * kDegree).is_shown) << "a robot that is carried";
	drive.scans.resize(1);
	EXPECT_FALSE(agreement(180 * kDegree).is_shown);
}

TEST(Calibration, FindsScales)
{
	DriveSettings settings;
	settings.truth.range_factor = 1.05;
	settings.truth.angle_scale = 0.97;
	settings.truth.duration = -0.2;
	settings.truth.start = 0;
	const Calibration result = calibrate_drive(settings);
	EXPECT_NEAR(result.shown.range_factor, 1.05, 0.004);
	EXPECT_NEAR(result.shown.angle_scale, 0.97, 0.004);
	EXPECT_NEAR(result.shown.duration, -0.2, 0.02);
}
}  // namespace
}  // namespace d2s1r::test
