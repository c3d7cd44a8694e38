// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <thread>

#include "filter_on_a_floor.h"
#include "mrpt_types.h"

namespace d2s1r::test
{
namespace
{
TEST_F(FilterOnAFloor, FollowsADriveWithOdometry)
{
	const Drive drive = drive_along(along_corridor(25));
	const auto poses = follow(drive);
	for (std::size_t i = 0; i < poses.size(); i++)
	{
		expect_at(poses[i], drive[i].truth, "frame " + std::to_string(i));
		EXPECT_EQ(poses[i].event, i == 0 ? FusionEvent::kSeeded : FusionEvent::kNone) << i;
	}
}

TEST_F(FilterOnAFloor, AnotherFilterInTheProcessAndOtherThreadsChangeNothing)
{
	const Drive drive = drive_along(along_corridor(6));
	const auto alone = follow(drive);
	CParticleFilterFusion other;
	other.start({{map()}}, {MotionSource::kPseudo, 301, 5});  // draws an odd number of normal numbers
	filter_.start({{map()}}, {});
	for (std::size_t i = 0; i < drive.size(); i++)
	{
		const FusionInput input{drive[i].scan, drive[i].localization, drive[i].odometry};
		other.step(input);
		std::optional<FusedPose> pose;
		if (i % 2 == 0)
			pose = filter_.step(input);
		else
			std::thread([&] { pose = filter_.step(input); }).join();
		ASSERT_TRUE(pose);
		EXPECT_EQ(pose->pose, alone[i].pose) << i;
	}
}

TEST_F(FilterOnAFloor, GetsMoreCertainScanByScan)
{
	Drive drive = drive_along(along_corridor(5));
	drive[0].localization = result_of({hypothesis_at(CPose2D(drive[0].truth), 0.95, {0.3, 0.3, 0.1})});
	const auto poses = follow(drive);
	for (const int axis : {0, 1, 2}) EXPECT_LT(deviation(poses[4], axis), 0.5 * deviation(poses[0], axis)) << axis;
}

TEST_F(FilterOnAFloor, FindsAKidnappedRobotAndSaysSo)
{
	const Drive drive = kidnapped(10, 5);
	const auto poses = follow(drive);
	expect_at(poses.back(), drive.back().truth);
	std::vector<std::size_t> reseeded;
	for (std::size_t i = 0; i < poses.size(); i++)
		if (poses[i].event == FusionEvent::kReseeded) reseeded.push_back(i);
	ASSERT_EQ(reseeded.size(), 1U);
	EXPECT_GE(reseeded[0], 10U);
}

TEST_F(FilterOnAFloor, GoesOverAtOnceIfItsParticlesDoNotExplainTheScanAtAll)
{
	filter_.tuning.takeover_margin = 8;  // the more easily, the smaller the floor
	const Drive drive = kidnapped(10, 1);
	const FusedPose pose = follow(drive).back();
	expect_at(pose, drive.back().truth);
	EXPECT_EQ(pose.event, FusionEvent::kReseeded);
}

TEST(FilterInRooms, LeavesAPlaceThatHasAllWallsTheScanShowsAndMoreInBetween)
{
	// a hall of 7 m beside rooms of 2 m, whose walls are as far apart as those of the hall
	const std::string wall(31, '#'), beside_hall = "#....#....#....#" + std::string(14, '.') + "#";
	Picture picture{wall};
	for (int y = 1; y <= 14; y++)
		picture.push_back(y % 5 > 0 ? beside_hall : std::string(16, '#') + std::string(14, '.') + "#");
	picture.push_back(wall);
	picture[3][29] = '#';  // else the hall looks the same from four sides
	const Grid floor = make_building(picture), world = world_of(floor);
	const TPose2D room{4, 4, 0}, hall{11.5, 4, 0};
	const auto frame_at = [&](const TPose2D& truth)
	{
		Frame frame{
		    truth, make_mrpt_observation(world, truth), result_of({hypothesis_at(CPose2D(truth), 0.99)}), CPose2D()};
		return frame;
	};
	CParticleFilterFusion filter;
	filter.start({{CSignatureMap2D::Create(*make_mrpt_map(floor))}}, {});
	const Frame before = frame_at(room), after = frame_at(hall);
	for (int i = 0; i < 5; i++)
		expect_at(filter.step({before.scan, before.localization, before.odometry}).value(), room);
	const FusedPose first = filter.step({after.scan, after.localization, after.odometry}).value();
	expect_at(first, hall);
	EXPECT_EQ(first.event, FusionEvent::kReseeded);
}

TEST_F(FilterOnAFloor, RecoversFromAWrongStart)
{
	Drive drive = drive_along(along_corridor(6));
	drive[0].localization = result_of({hypothesis_at({7.6, 3.6, 0.8}, 0.95)});
	expect_at(follow(drive).back(), drive.back().truth);
}

TEST_F(FilterOnAFloor, FindsOutWhereAnAmbiguousStartWasAndIsNotReseededByThat)
{
	Drive drive = drive_along(along_corridor(5));
	drive[0].localization =
	    result_of({hypothesis_at({7.6, 3.6, 0.8}, 0.55), hypothesis_at(CPose2D(drive[0].truth), 0.4)});
	const auto poses = follow(drive);
	EXPECT_EQ(poses[0].status, FusionStatus::kAmbiguous);
	EXPECT_GT(distance_between(poses[0].pose, drive[0].truth), 5);
	expect_at(poses.back(), drive.back().truth);
	for (std::size_t i = 1; i < poses.size(); i++) EXPECT_EQ(poses[i].event, FusionEvent::kNone) << i;
}

TEST_F(FilterOnAFloor, AStartThatMayWellBeWrongIsNotTrackedAndGivesWaySooner)
{
	Drive drive = drive_along(along_corridor(12));
	for (const std::size_t i : {1U, 2U}) drive[i] = blind(drive[i], Status::kRejected);
	const auto scans_until_right = [&](double probability, FusionStatus expected)
	{
		const CPose2D further_along(drive[0].truth.x + 1.5, drive[0].truth.y, drive[0].truth.phi);
		drive[0].localization = result_of({hypothesis_at(further_along, probability)});
		const auto poses = follow(drive);
		EXPECT_EQ(poses[0].status, expected) << probability;
		EXPECT_EQ(poses[2].status, FusionStatus::kAmbiguous) << "no scan has shown where the odometry led";
		std::size_t scans = 3;
		while (scans < poses.size() && distance_between(poses[scans].pose, drive[scans].truth) > 0.5) scans++;
		return scans;
	};
	EXPECT_EQ(scans_until_right(0.05, FusionStatus::kAmbiguous), 3U);
	EXPECT_GT(scans_until_right(0.95, FusionStatus::kTracking), 3U);
}

TEST_F(FilterOnAFloor, GoesByHypothesesIfTheScanSaysNothing)
{
	const Hypothesis here = hypothesis_at({-1, 6, 0}, 0.4), there = hypothesis_at({7.6, 3.6, 0.8}, 0.55);
	Drive drive = drive_along({{-1, 6, 0}});
	drive[0].localization = result_of({there, here});
	for (int i = 0; i < 4; i++)
	{
		drive.push_back(blind_stop(drive.back()));
		drive.back().localization = result_of({hypothesis_at(here.pose, 0.8), hypothesis_at(there.pose, 0.15)});
	}
	const auto poses = follow(drive);
	EXPECT_GT(distance_between(poses[0].pose, drive[0].truth), 5);
	expect_at(poses.back(), drive.back().truth);
}

TEST_F(FilterOnAFloor, OneWrongLocalizationDoesNotMoveIt)
{
	Drive drive = drive_along(along_corridor(8));
	drive[5].localization = result_of({hypothesis_at({7.6, 3.6, 0.8}, 0.95)});
	const auto poses = follow(drive);
	EXPECT_EQ(poses[5].status, FusionStatus::kAmbiguous) << "scan and filter do not agree";
	EXPECT_LT(distance_between(poses[5].pose, drive[5].truth), 0.1);
	for (std::size_t i = 6; i < poses.size(); i++) expect_at(poses[i], drive[i].truth, std::to_string(i));
}

TEST_F(FilterOnAFloor, ACoveredSensorDoesNotMoveIt)
{
	Drive drive = drive_along(along_corridor(20));
	for (std::size_t i = 8; i < 16; i++)
	{
		for (std::size_t beam = 0; beam < drive[i].scan.getScanSize(); beam++)
			drive[i].scan.setScanRange(beam, 0.1F + 0.02F * static_cast<float>(beam % 10));
		drive[i].localization = map()->localizer().localize(scan_of(drive[i].scan));
	}
	const auto poses = follow(drive);
	for (std::size_t i = 8; i < 16; i++) EXPECT_LT(distance_between(poses[i].pose, drive[i].truth), 0.8) << i;
	for (std::size_t i = 18; i < 20; i++) expect_at(poses[i], drive[i].truth, std::to_string(i));
}

TEST_F(FilterOnAFloor, AScanThatMayWellShowNothingOfTheMapDoesNotMoveIt)
{
	for (const double probability : {0.2, 0.4})
	{
		Drive drive = drive_along(along_corridor(16));
		for (std::size_t i = 8; i < 12; i++)
		{
			drive[i].scan = make_mrpt_observation(kWorld, {7.6, 3.6, 0.8}, Laser());
			drive[i].localization = result_of({hypothesis_at({7.6, 3.6, 0.8}, probability)});
		}
		const auto poses = follow(drive);
		// the place shown is 5 m away or more
		for (std::size_t i = 8; i < 12; i++) EXPECT_LT(distance_between(poses[i].pose, drive[i].truth), 1) << i;
		expect_at(poses.back(), drive.back().truth);
	}
}

TEST_F(FilterOnAFloor, TracksNothingWhereTheMapExplainsFewScans)
{
	Drive drive = drive_along(along_corridor(25));
	for (std::size_t i = 0; i < drive.size(); i++)
		drive[i].localization = i % 3 == 0 ? result_of({hypothesis_at(CPose2D(drive[i].truth), 0.6)})
		                                   : no_place(Status::kRejected, "another building");
	const auto poses = follow(drive);
	for (std::size_t i = 15; i < poses.size(); i++) EXPECT_EQ(poses[i].status, FusionStatus::kAmbiguous) << i;
}

TEST_F(FilterOnAFloor, FewParticlesThatCountAreNoCertainty)
{
	FusionParameters parameters;
	parameters.filter.particles = 1;
	const auto poses = follow(drive_along(along_corridor(6)), parameters);
	for (std::size_t i = 1; i < poses.size(); i++)
		for (const int axis : {0, 1, 2}) EXPECT_GT(deviation(poses[i], axis), 0.01) << i << ", " << axis;
}

TEST_F(FilterOnAFloor, LooksForPlacesThatNoScanShowedWithinThePriorOnly)
{
	FusionParameters parameters;
	const Prior prior = make_prior(-3, 5, 3, 7);
	Drive drive = drive_along(along_corridor(1));
	drive[0].localization = result_of({hypothesis_at(CPose2D(drive[0].truth), 0.01)});
	drive.push_back(blind_stop(drive[0]));
	const auto within = [&](const Prior& used)
	{
		const FusedPose pose = follow(drive, parameters, used).back();
		return prior.allows_position(pose.pose.x, pose.pose.y, 0.5);
	};
	int elsewhere = 0;
	for (parameters.seed = 1; parameters.seed <= 5; parameters.seed++)
	{
		EXPECT_TRUE(within(prior)) << parameters.seed;
		elsewhere += within({}) ? 0 : 1;
	}
	EXPECT_GT(elsewhere, 0);
}

TEST_F(FilterOnAFloor, StaysWithinThePrior)
{
	Drive drive = drive_along(along_corridor(12));
	const Prior prior = make_prior(drive[0].truth.x - 0.5, 5, drive[6].truth.x, 7);
	filter_.start({{map(), prior}}, {});
	int poses = 0;
	for (std::size_t i = 0; i < drive.size(); i++)
	{
		if (!prior.allows(drive[i].truth)) drive[i].localization = no_place(Status::kRejected, "outside");
		const auto pose = filter_.step({drive[i].scan, drive[i].localization, drive[i].odometry});
		if (!pose) continue;
		EXPECT_TRUE(prior.allows(pose->pose)) << i << ": " << pose->pose;
		poses++;
	}
	EXPECT_GE(poses, 6);
	EXPECT_LT(poses, 12) << "no particle is left in the end";
}

TEST_F(FilterOnAFloor, WaitsForAFirstHypothesis)
{
	Drive drive = drive_along(along_corridor(3));
	drive[0].localization = drive[1].localization = no_place(Status::kRejected, "crowded");
	filter_.start({{map()}}, {});
	for (std::size_t i = 0; i < 2; i++) EXPECT_FALSE(filter_.step({drive[i].scan, drive[i].localization, {}}));
	const auto pose = filter_.step({drive[2].scan, drive[2].localization, {}});
	ASSERT_TRUE(pose);
	EXPECT_EQ(pose->event, FusionEvent::kSeeded);
	expect_at(*pose, drive[2].truth);
}

TEST_F(FilterOnAFloor, ScanWithoutBeamsIsNoUseButNoHarm)
{
	Drive drive = drive_along(along_corridor(4));
	Frame frame = blind_stop(drive.back());
	frame.scan.resizeScan(0);
	drive.push_back(frame);
	expect_at(follow(drive).back(), frame.truth);
}

TEST_F(FilterOnAFloor, TracksOnThroughScansThatAreNoneUntilTheOdometryLeavesMoreThanOnePlace)
{
	Drive drive = drive_along(along_corridor(5));
	for (int i = 0; i < 12; i++) drive.push_back(blind_stop(drive.back()));
	Frame seen = drive[4];
	seen.odometry = CPose2D();
	drive.push_back(seen);
	const auto poses = follow(drive);
	EXPECT_EQ(poses[6].status, FusionStatus::kTracking);
	EXPECT_EQ(poses[16].status, FusionStatus::kAmbiguous);
	EXPECT_LT(distance_between(poses[16].pose, seen.truth), 0.5);
	expect_at(poses[17], seen.truth);
}

TEST_F(FilterOnAFloor, APlaceThatItJumpedToIsNotTrackedBeforeScansLeaveLittleDoubtOfIt)
{
	Drive drive = kidnapped(10, 5);
	for (std::size_t i = 10; i < drive.size(); i++)
		drive[i].localization =
		    result_of({hypothesis_at(CPose2D(drive[i].truth), 0.55), hypothesis_at({7.6, 3.6, 0.8}, 0.44)});
	const auto poses = follow(drive);
	double doubt = 1;
	for (std::size_t i = 10; i < drive.size(); i++)
	{
		if (distance_between(poses[i].pose, drive[i].truth) < 0.3) doubt *= 0.45;
		EXPECT_EQ(poses[i].status == FusionStatus::kTracking, doubt < 0.1) << i;
	}
	expect_at(poses.back(), drive.back().truth);
}

TEST_F(FilterOnAFloor, StartingAnewForgetsTheDriveBefore)
{
	Drive frozen = drive_along(along_corridor(12));
	for (Frame& frame : frozen) frame.odometry = CPose2D();
	const Drive drive = drive_along(along_corridor(6));
	const auto fresh = follow(drive);
	follow(frozen);
	const auto again = follow(drive);
	for (std::size_t i = 0; i < drive.size(); i++) EXPECT_EQ(fresh[i].pose, again[i].pose) << i;
}
}  // namespace
}  // namespace d2s1r::test
