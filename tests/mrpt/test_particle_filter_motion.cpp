// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What moves the particles from frame to frame, and what it leaves open.
#include <d2s1r/motion.h>

#include "filter_on_a_floor.h"

namespace d2s1r::test
{
namespace
{
TEST_F(FilterOnAFloor, FrozenOdometryIsNotFollowed)
{
	Drive drive = drive_along(along_corridor(25));
	for (Frame& frame : drive) frame.odometry = CPose2D();
	const auto poses = follow(drive);
	for (std::size_t i = 5; i < poses.size(); i++) expect_at(poses[i], drive[i].truth, std::to_string(i));
}

TEST_F(FilterOnAFloor, BlindFramesWidenIt)
{
	Drive drive = drive_along(along_corridor(5));
	for (int i = 0; i < 3; i++) drive.push_back(blind_stop(drive.back()));
	const auto poses = follow(drive);
	for (std::size_t i = 5; i < poses.size(); i++)
		for (const int axis : {0, 1, 2})
			EXPECT_GT(deviation(poses[i], axis), deviation(poses[i - 1], axis)) << i << ", " << axis;
	EXPECT_LT(distance_between(poses.back().pose, drive.back().truth), 0.2);
}

TEST_F(FilterOnAFloor, RejectedFramesMoveItByTheOdometryAndWidenIt)
{
	Drive drive = drive_along(along_corridor(12));
	for (std::size_t i = 6; i < drive.size(); i++) drive[i] = blind(drive[i], Status::kRejected);
	const auto poses = follow(drive);
	EXPECT_LT(distance_between(poses.back().pose, drive.back().truth), 0.4);
	for (const int axis : {0, 1, 2}) EXPECT_GT(deviation(poses.back(), axis), 2 * deviation(poses[5], axis)) << axis;
}

TEST_F(FilterOnAFloor, MotionErrorsHaveNothingToDoWithThoseOfTheSeed)
{
	Drive drive = drive_along(along_corridor(1));
	drive[0].localization = result_of({hypothesis_at(CPose2D(drive[0].truth), 0.97, {0.1, 0.1, 0.1})});
	drive.push_back(blind_stop(drive[0]));
	FusionParameters parameters;
	parameters.filter.particles = 10000;
	const auto poses = follow(drive, parameters);
	for (const int axis : {0, 1, 2})
	{
		EXPECT_NEAR(deviation(poses[0], axis), 0.1, 0.005) << axis;
		EXPECT_NEAR(deviation(poses[1], axis), std::sqrt(0.01 + odometry_motion({}).cov(axis, axis)), 0.007) << axis;
	}
}

TEST_F(FilterOnAFloor, OdometryAloneTakesNoNoticeOfPseudoOdometry)
{
	Drive drive = drive_along(along_corridor(6));
	for (Frame& frame : drive) frame.odometry.reset();
	FusionParameters parameters;
	const auto particles = [&](MotionSource source)
	{
		parameters.motion = source;
		return follow(drive, parameters).back().particles;
	};
	EXPECT_EQ(particles(MotionSource::kPseudo), 200U);
	EXPECT_EQ(particles(MotionSource::kOdometry), 1000U) << "nobody measured where it went";
}

TEST_F(FilterOnAFloor, OdometryAloneIsMovedByTheScaleAndTheErrorsThatScansShow)
{
	Drive drive = drive_along(along_corridor(25));
	FusionParameters parameters;
	parameters.motion = MotionSource::kOdometry;
	for (const double scale : {0.6, 1.7})
		for (const double turn : {0.0, 12.0})  // [deg] of error, to both sides in turn
		{
			Drive disturbed = drive;
			for (std::size_t i = 1; i < drive.size(); i++)
			{
				const CPose2D& step = *drive[i].odometry;
				const double off = mrpt::DEG2RAD(i % 2 == 0 ? turn : -turn);
				disturbed[i].odometry = CPose2D(scale * step.x(), scale * step.y(), step.phi() + off);
			}
			const auto poses = follow(disturbed, parameters);
			for (std::size_t i = 0; i < poses.size(); i++)
			{
				const bool is_right = distance_between(poses[i].pose, drive[i].truth) < 0.5;
				EXPECT_TRUE(is_right || poses[i].status != FusionStatus::kTracking)
				    << scale << ", " << turn << ", " << i;
			}
			expect_at(poses.back(), drive.back().truth, std::to_string(scale) + ", " + std::to_string(turn));
		}
}

TEST_F(FilterOnAFloor, WithoutAnyMotionItGoesOnAsBefore)
{
	Drive drive = drive_along(along_corridor(12));
	for (std::size_t i = 8; i < drive.size(); i++) drive[i] = blind(drive[i], Status::kInvalid);
	for (Frame& frame : drive) frame.odometry.reset();
	const auto poses = follow(drive);
	const double way = distance_between(drive[7].truth, drive[9].truth);
	EXPECT_GT(distance_between(poses[7].pose, poses[9].pose), 0.5 * way);
}

TEST_F(FilterOnAFloor, WhatIsNotKnownOfAMotionIsAheadOfTheRobotWhereverThatIs)
{
	FusionParameters parameters;
	parameters.filter.particles = 1;
	Drive drive = drive_along({{4.3, 8.3, M_PI / 2}});
	drive.push_back(blind_stop(drive[0]));
	drive.back().odometry.reset();
	const FusedPose pose = follow(drive, parameters).back();
	EXPECT_GT(deviation(pose, 1), 2 * deviation(pose, 0)) << "it looks along y";
}

TEST_F(FilterOnAFloor, PseudoOdometryTakesNoNoticeOfOdometry)
{
	Drive drive = drive_along(along_corridor(10));
	FusionParameters parameters;
	parameters.motion = MotionSource::kPseudo;
	const auto with = follow(drive, parameters);
	for (Frame& frame : drive) frame.odometry = CPose2D(-1, 1, 1);
	const auto wrong = follow(drive, parameters);
	for (std::size_t i = 0; i < drive.size(); i++) EXPECT_EQ(with[i].pose, wrong[i].pose) << i;
	expect_at(with.back(), drive.back().truth);
}
}  // namespace
}  // namespace d2s1r::test
