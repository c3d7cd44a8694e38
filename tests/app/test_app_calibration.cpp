// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Logs whose messages say what is wrong of a laser or of the odometry, of the kinds that people report: once the drive
// has shown it, poses are right.
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <nlohmann/json.hpp>

#include "app_process.h"
#include "app_world.h"
#include "told_drive.h"

using namespace d2s1r::test;

namespace
{
struct Score
{
	std::size_t frames = 0, right = 0, wrong = 0;  //!< [-] all; localized within 0.3 m and 5 deg; localized elsewhere
};

/// Returns the objects of a drive as a log of MRPT has them.
Objects objects_of(const ToldDrive& told)
{
	using namespace mrpt::obs;
	const SimulatedDrive drive = simulate_drive(make_floor(), told.drive);
	const auto time_of = [](double time) { return mrpt::Clock::fromDouble(kDriveStart + time); };
	const double step = told.drive.field_of_view / told.drive.beams;
	Objects objects;
	std::size_t read = 0;
	for (const auto& scan : drive.scans)
	{
		for (; read < drive.odometry.size() && drive.robot[read].time <= scan.time; read++)
		{
			auto odometry = CObservationOdometry::Create();
			odometry->timestamp = time_of(drive.odometry[read].time);
			odometry->odometry = mrpt::poses::CPose2D(drive.odometry[read].robot);
			objects.push_back(odometry);
		}
		auto seen = CObservation2DRangeScan::Create();
		seen->sensorLabel = "LASER";
		seen->timestamp = time_of(scan.time);
		seen->aperture = static_cast<float>(step * (told.drive.beams - 1));
		seen->maxRange = 20;
		seen->rightToLeft = !told.are_scans_mirrored;
		const double middle = 0.5 * step * (told.drive.beams - 1) + static_cast<double>(scan.first_angle);
		seen->sensorPose = mrpt::poses::CPose3D(0.2, 0, 0.2, told.are_scans_mirrored ? -middle : middle, 0, 0);
		const auto beams = static_cast<std::size_t>(told.drive.beams);
		seen->resizeScanAndAssign(beams, 0, false);
		for (const auto& beam : scan.returns)
		{
			const auto i = static_cast<std::size_t>(std::lround(beam.share * static_cast<float>(beams - 1)));
			seen->setScanRange(i, beam.range);
			seen->setScanRangeValidity(i, true);
		}
		objects.push_back(seen);
	}
	return objects;
}
}  // namespace

class AppCalibration : public AppTest
{
   protected:
	AppCalibration() { save_map(make_floor(), path("floor.yaml")); }

	Score score_of(const ToldDrive& told, const Words& more = {})
	{
		write_file(path("log.mcap"), mcap_file(messages_of(told)));
		Words words = {"-m", path("floor.yaml"), "-i", path("log.mcap"), "--stream", "--sensor-label", "/scan"};
		words.insert(words.end(), more.begin(), more.end());
		return score_of(told, run(words), 0);
	}

	/// Of frames from the first one on, of a log that grows.
	Score followed_score_of(const ToldDrive& told, std::size_t first)
	{
		save(objects_of(told), path("log.rawlog"));
		const std::string words =
		    RAWLOG_LOCALIZE " -m " + path("floor.yaml") + " -i - --stream < " + path("log.rawlog");
		return score_of(told, run_program({"bash", "-c", words}), first);
	}

	Score score_of(const ToldDrive& told, const ProcessResult& result, std::size_t first)
	{
		EXPECT_EQ(result.status, 0) << result.err;
		said_ = result.err;
		const auto robots = robots_of(told);
		const Words lines = lines_of(result.out);
		EXPECT_EQ(lines.size(), robots.size());
		Score score;
		for (std::size_t i = first; i < std::min(lines.size(), robots.size()); i++)
		{
			const auto frame = nlohmann::json::parse(lines[i]);
			score.frames++;
			if (frame["status"] != "localized") continue;
			const mrpt::math::TPose2D pose(frame["x"], frame["y"], frame["phi"]);
			const bool is_right = distance_between(pose, robots[i]) < 0.3 && turn_between(pose, robots[i]) < 5;
			(is_right ? score.right : score.wrong)++;
		}
		return score;
	}

	/// Expects that at least 90 % of the frames are right, and none is localized and wrong.
	void expect_right(const std::string& name, const ToldDrive& told, const Words& more = {})
	{
		const Score score = score_of(told, more);
		EXPECT_EQ(score.wrong, 0U) << name << '\n' << said_;
		EXPECT_GE(score.right, (9 * score.frames + 9) / 10) << name << " of " << score.frames << '\n' << said_;
	}

	std::string said_;  //!< by the program
};

TEST_F(AppCalibration, AnglesThatContradictEachOther)
{
	for (const double off : {0.1, -0.1, 0.03, -0.03, 0.007, -0.007})
	{
		ToldDrive told;
		told.told_step = 1 + off;
		expect_right("angle_increment off by " + std::to_string(off), told);
	}
}

TEST_F(AppCalibration, TurnedLasers)
{
	for (const double turned : {180., 90., -90., 45., 20., 10., 5., -20.})
	{
		ToldDrive told;
		told.drive.truth.laser.phi = turned * kDegree;
		expect_right("turned by " + std::to_string(turned) + " deg", told);
	}
}

TEST_F(AppCalibration, StampsAtTheEndOrTheMiddleOfTheSweep)
{
	for (const double rate : {0.5, 1., 2.})
		for (const double share : {1., 0.5})
		{
			ToldDrive told(rate);
			told.drive.truth.duration = told.told_duration = 0.1;
			told.drive.truth.start = -share * 0.1;
			expect_right(std::to_string(rate) + " rad/s, stamped at " + std::to_string(share), told);
		}
}

TEST_F(AppCalibration, BeamsInAnotherOrderOrOtherTimes)
{
	for (const double rate : {1., 2.})
	{
		ToldDrive reversed(rate);
		reversed.told_duration = 0.1;
		reversed.drive.truth.duration = -0.1;
		expect_right("reversed at " + std::to_string(rate), reversed);
		reversed.drive.odometry_error = 0.15;
		expect_right("reversed, rough odometry, at " + std::to_string(rate), reversed);
		reversed.told_duration = -0.1;
		reversed.drive.truth.duration = 0.1;
		expect_right("told as reversed, at " + std::to_string(rate), reversed);
		ToldDrive too_small(rate);
		too_small.told_duration = 0.01;
		too_small.drive.truth.duration = 0.2;
		expect_right("time_increment 20 times too small at " + std::to_string(rate), too_small);
		ToldDrive at_once(rate);
		at_once.told_duration = 0.2;
		expect_right("all beams at once at " + std::to_string(rate), at_once);
	}
}

TEST_F(AppCalibration, OdometryOfAnotherClock)
{
	for (const double clock : {1., -1., 3., -3., -8310659.})
	{
		ToldDrive told;
		told.drive.truth.odometry_clock = clock;
		told.drive.truth.duration = told.told_duration = 0.1;
		expect_right("odometry off by " + std::to_string(clock) + " s", told);
	}
	for (const double clock : {0.3, -0.3})
	{
		ToldDrive few(0.4, 8);
		few.drive.truth.odometry_clock = clock;
		expect_right("8 scans, odometry off by " + std::to_string(clock) + " s", few);
	}
}

TEST_F(AppCalibration, OtherTransforms)
{
	ToldDrive both;
	both.moving_mount = MadeTransform{"base_link", "laser", 0.2, 0, 0.2, 'z', M_PI / 2};
	expect_right("tf and tf_static", both);
	for (const double yaw : {90., 180.})
		for (const char axis : {'x', 'y'})
		{
			ToldDrive told;
			told.drive.truth.laser.phi = yaw * kDegree;
			told.mount = {"base_link", "laser", 0.2, 0, 0.2, axis, yaw * kDegree};
			expect_right(std::to_string(yaw) + " deg about " + std::string(1, axis), told);
		}
	for (const double yaw : {90., 180., 45.})
	{
		ToldDrive told;
		told.drive.truth.laser.phi = yaw * kDegree;
		told.mount.angle = yaw;  // [deg]
		expect_right("radians for degrees " + std::to_string(yaw), told);
	}
	for (const double yaw : {90., 180.})
	{
		ToldDrive blind;
		blind.drive.truth.laser.phi = yaw * kDegree;
		blind.mount = {"base_link", "laser", 0.2, 0, 0.2, 'x', yaw * kDegree};
		blind.has_odometry = false;
		EXPECT_EQ(score_of(blind).wrong, 0U) << "nothing shows the yaw\n" << said_;
	}
	ToldDrive narrow(1.98);
	narrow.drive.seed = 2084;
	narrow.drive.field_of_view = 240 * kDegree;
	const Score rightly = score_of(narrow);
	narrow.mount = {"base_link", "laser", 0.2, 0, 0.2, 'x', M_PI};
	const Score corrected = score_of(narrow);
	EXPECT_LT(2 * rightly.right, rightly.frames);
	EXPECT_GE(corrected.right, rightly.right) << said_;
	EXPECT_EQ(corrected.wrong, 0U) << said_;
	ToldDrive upside_down;
	upside_down.are_scans_mirrored = true;
	expect_right("upside down", upside_down);
}

TEST_F(AppCalibration, LogsThatAreFollowed)
{
	for (const double turned : {0., 90.})
	{
		ToldDrive upside_down(1, 60);
		upside_down.are_scans_mirrored = true;
		upside_down.drive.truth.laser.phi = turned * kDegree;
		const Score score = followed_score_of(upside_down, 40);
		EXPECT_EQ(score.wrong, 0U) << turned << '\n' << said_;
		EXPECT_GE(score.right, 18U) << turned << " of 20\n" << said_;
	}
}

TEST_F(AppCalibration, LasersElsewhereOnTheRobot)
{
	for (const double yaw : {45., 90., -90., 180.})
	{
		ToldDrive inverse(1.5);
		inverse.drive.truth.laser.phi = yaw * kDegree;
		const mrpt::math::TPose2D told = mrpt::math::TPose2D() - inverse.drive.truth.laser;
		inverse.mount = {"base_link", "laser", told.x, told.y, 0.2, 'z', told.phi};
		expect_right("transform the other way round, yaw " + std::to_string(yaw), inverse);
		inverse.drive.odometry_error = 0.1;
		expect_right("the same and rough odometry", inverse);
	}
	// x differs by so little that it would be kept, and would then bend the yaw.
	ToldDrive aside(1.53, 20);
	aside.drive.seed = 2067;
	aside.drive.truth.laser = {0.077, -0.41, 0};
	expect_right("aside", aside);
	EXPECT_EQ(said_.find("yaw of the laser"), std::string::npos) << said_;
	ToldDrive by_a_little(0.72, 20);  // x by 5 cm, which bent the yaw by 5 deg
	by_a_little.drive.seed = 2306;
	by_a_little.drive.field_of_view = 240 * kDegree;
	by_a_little.drive.truth.laser = {0.25, 0.195, 146.1 * kDegree};
	EXPECT_EQ(score_of(by_a_little).wrong, 0U) << said_;
	// Far from the middle of the robot it moves as if ways were in another unit.
	ToldDrive far_off(0.9, 20);
	far_off.drive.seed = 2287;
	far_off.drive.truth.laser = {0.58, 0.19, -38 * kDegree};
	expect_right("far from the middle", far_off);
	// Of wheels that are off, too, the whole transform is corrected: the yaw alone would be bent by x and y as told.
	ToldDrive wheels_off(1.77);
	wheels_off.drive.seed = 2225;
	wheels_off.drive.field_of_view = 240 * kDegree;
	const Score rightly = score_of(wheels_off);
	wheels_off.drive.truth.way_scale = 1.7;
	wheels_off.drive.truth.turn_scale = 0.9;
	wheels_off.drive.truth.laser = {0.093, -0.268, 104 * kDegree};
	const Score corrected = score_of(wheels_off);
	EXPECT_GE(corrected.right, rightly.right) << said_;
	EXPECT_EQ(corrected.wrong, 0U) << said_;
	// By its motions this laser cannot be told from one in front of a robot that drives backwards.
	ToldDrive behind(1.74);
	behind.drive.seed = 2070;
	behind.drive.truth.laser = {-0.2, 0.01, -92 * kDegree};
	expect_right("behind and turned", behind);
}

TEST_F(AppCalibration, OdometryInAnotherUnit)
{
	for (const double ways : {100., 0.01})
	{
		ToldDrive told(1.66);
		told.drive.seed = 2204;
		told.drive.truth.way_scale = ways;
		told.drive.truth.range_factor = 0.994;
		expect_right("ways times " + std::to_string(ways), told);
	}
	ToldDrive and_turns(1.87, 20);
	and_turns.drive.seed = 2072;
	and_turns.drive.odometry_error = 0.02;
	and_turns.drive.truth.way_scale = 100;
	and_turns.drive.truth.turn_scale = 0.8;
	expect_right("ways times 100, turns 0.8", and_turns);
}

TEST_F(AppCalibration, MirroredOdometry)
{
	for (const double rate : {1., 2.})
	{
		ToldDrive told(rate);
		told.drive.truth.is_odometry_mirrored = true;
		told.drive.truth.duration = told.told_duration = 0.2;
		expect_right("mirrored odometry at " + std::to_string(rate), told);
	}
	ToldDrive to_and_fro(2);
	to_and_fro.drive.seed = 29;
	to_and_fro.drive.truth.is_odometry_mirrored = true;
	expect_right("mirrored odometry of a robot that turns to and fro", to_and_fro);
}

TEST_F(AppCalibration, TwoFaultsAtOnce)
{
	ToldDrive turned_and_late;
	turned_and_late.drive.truth.laser.phi = 90 * kDegree;
	turned_and_late.drive.truth.duration = turned_and_late.told_duration = 0.1;
	turned_and_late.drive.truth.start = -0.1;
	expect_right("turned and late", turned_and_late);
	ToldDrive mirrored_and_other_clock;
	mirrored_and_other_clock.drive.truth.is_odometry_mirrored = true;
	mirrored_and_other_clock.drive.truth.odometry_clock = 1;
	mirrored_and_other_clock.drive.truth.duration = mirrored_and_other_clock.told_duration = 0.1;
	expect_right("mirrored odometry of another clock", mirrored_and_other_clock);
	ToldDrive turned_and_mirrored;
	turned_and_mirrored.drive.truth.laser.phi = 180 * kDegree;
	turned_and_mirrored.drive.truth.is_odometry_mirrored = true;
	expect_right("turned and mirrored odometry", turned_and_mirrored);
	ToldDrive turned_and_reversed;
	turned_and_reversed.drive.truth.laser.phi = 20 * kDegree;
	turned_and_reversed.told_duration = 0.1;
	turned_and_reversed.drive.truth.duration = -0.1;
	expect_right("turned and reversed", turned_and_reversed);
	ToldDrive angles_and_late;
	angles_and_late.told_step = 1.03;
	angles_and_late.drive.truth.duration = angles_and_late.told_duration = 0.1;
	angles_and_late.drive.truth.start = -0.05;
	expect_right("angles and stamp in the middle", angles_and_late);
}

TEST_F(AppCalibration, FewScansNarrowViewsAndRoughOdometry)
{
	for (const double turned : {180., 90., 45., 20.})
	{
		ToldDrive few(1, 8);
		few.drive.truth.laser.phi = turned * kDegree;
		expect_right("8 scans turned by " + std::to_string(turned), few);
		ToldDrive narrow;
		narrow.drive.field_of_view = 1.5 * M_PI;
		narrow.drive.truth.laser.phi = turned * kDegree;
		// Where a narrow view is ambiguous, no calibration helps: as many are right as of a laser that is told rightly.
		const Words rightly = {"--sensor-pose", "0.2,0,0.2," + std::to_string(turned) + ",0,0"};
		const Score best = score_of(narrow, rightly), own = score_of(narrow);
		EXPECT_GE(own.right, best.right) << "270 deg turned by " << turned << '\n' << said_;
		EXPECT_EQ(own.wrong, 0U) << turned;
		EXPECT_GT(best.right, 30U) << turned;
		ToldDrive rough;
		rough.drive.odometry_error = 0.2;
		rough.drive.truth.laser.phi = turned * kDegree;
		expect_right("rough odometry turned by " + std::to_string(turned), rough);
		ToldDrive on_tf;
		on_tf.is_odometry_on_tf = true;
		on_tf.drive.truth.laser.phi = turned * kDegree;
		expect_right("tf turned by " + std::to_string(turned), on_tf);
	}
}

TEST_F(AppCalibration, RoughWheelsOfARobotThatTurnsFastAreNotAbsurd)
{
	ToldDrive turned(1.92023);
	turned.drive.seed = 3228;
	turned.drive.odometry_error = 0.15;
	turned.drive.truth.laser.phi = 90 * kDegree;
	expect_right("turned by 90 deg", turned);
}

TEST_F(AppCalibration, OfTwoMotionsAClearOneCountsAgainstOneThatSaysLittle)
{
	ToldDrive turned(1.636925, 8);  // three of its scans are found
	turned.drive.seed = 3030;
	turned.drive.field_of_view = 1.5 * M_PI;
	turned.drive.odometry_error = 0.1;
	turned.drive.truth.laser.phi = -90 * kDegree;
	EXPECT_EQ(score_of(turned).wrong, 0U) << said_;
}

TEST_F(AppCalibration, FewScansThatFitByAnotherMountingOnly)
{
	ToldDrive angles(1.5, 8);
	angles.drive.seed = 2;
	angles.told_step = 1.05;
	expect_right("8 scans, angle_increment off by 5 %", angles);
	ToldDrive mirrored(0.5, 8);
	mirrored.drive.seed = 3;
	mirrored.are_scans_mirrored = true;
	mirrored.drive.truth.laser.phi = 180 * kDegree;
	expect_right("8 scans, upside down and turned", mirrored);
}

TEST_F(AppCalibration, TwoLasers)
{
	for (const double turned : {180., 90., 20.})
		for (const bool is_other : {false, true})
		{
			ToldDrive told;
			told.drive.field_of_view = 1.5 * M_PI;
			told.other_laser = {-0.2, 0, is_other ? M_PI + turned * kDegree : M_PI};
			told.told_other_yaw = M_PI;
			if (!is_other) told.drive.truth.laser.phi = turned * kDegree;
			expect_right(
			    "merged, turned by " + std::to_string(turned) + (is_other ? " other" : ""), told, {"--merge-lasers"});
		}
}
