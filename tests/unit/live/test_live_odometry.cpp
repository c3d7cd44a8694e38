// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Transforms, odometry and clocks of a running robot, with times that the tests say.
#include "live/live_drive.h"

using namespace d2s1r;
using namespace d2s1r::test;
using namespace d2s1r::live;

TEST(LiveLocalizer, IsSilentWithoutATransformAndNamesIt)
{
	Drive drive;
	drive.add_map(drive.grid);
	drive.live.set_tracker_readers(1, 1);
	for (int i = 0; i < 10; i++) EXPECT_FALSE(drive.step());
	EXPECT_NE(drive.summary().find("no transform from the laser's frame 'laser' to 'base_link'"), std::string::npos)
	    << drive.summary();
	drive.live.add_transforms(drive.robot.laser_transform(), true);
	drive.steps(10);
	EXPECT_EQ(drive.seeds.size(), 1U) << "once it comes";
}

TEST(LiveLocalizer, WaitsForTransformsThatAreLate)
{
	Drive drive;
	drive.begin();
	drive.steps(5);
	drive.has_odometry = false;
	EXPECT_FALSE(drive.step());
	drive.live.add_transforms(drive.robot.odometry_transform(), false);
	const auto answers = drive.live.update(drive.robot.time + kSecond / 20);
	ASSERT_EQ(answers.size(), 1U);
	EXPECT_EQ(answers.front().time, drive.robot.time);
}

TEST(LiveLocalizer, MovesASeedToTheNewestTransform)
{
	Drive drive;
	drive.begin();
	drive.steps(3);
	drive.robot.time += kStep;
	drive.live.add_transforms(drive.robot.odometry_transform(), false);
	const auto scan = drive.robot.scan();
	drive.robot.time += kSecond / 5;
	drive.robot.move(0.3, 0.1);
	drive.live.add_transforms(drive.robot.odometry_transform(), false);
	drive.live.add_scan("/scan", scan);
	const auto answers = drive.live.update(drive.robot.time);
	ASSERT_EQ(answers.size(), 1U);
	ASSERT_TRUE(answers.front().seed);
	EXPECT_EQ(answers.front().seed->time, drive.robot.time);
	EXPECT_LT(distance_between(answers.front().seed->pose, drive.robot.pose), 0.1);
}

TEST(LiveLocalizer, CarriesASeedByTheOdometryThatCameMeanwhile)
{
	Drive drive;
	drive.begin();
	drive.takes_seeds = false;
	drive.steps(4);
	ASSERT_EQ(drive.seeds.size(), 1U);
	const Seed seed = drive.seeds.front().first;
	EXPECT_EQ(drive.live.carried(seed).time, seed.time);
	drive.robot.time += kSecond / 2;
	drive.robot.move(0.1, 0.6);
	drive.live.add_transforms(drive.robot.odometry_transform(), false);
	const Seed carried = drive.live.carried(seed);
	EXPECT_EQ(carried.time, drive.robot.time);
	EXPECT_LT(distance_between(carried.pose, drive.robot.pose), 0.1);
	EXPECT_LT(std::abs(mrpt::math::angDistance(carried.pose.phi(), drive.robot.pose.phi())), 0.05);
}

/// Somebody has a wrong clock for a moment.
TEST(LiveLocalizer, AMessageOfTheFutureDoesNotCountForEver)
{
	for (const bool is_message : {true, false})
	{
		Drive drive;
		drive.begin();
		drive.steps(20);
		ASSERT_EQ(drive.seeds.size(), 1U);
		const Time future = drive.robot.time + 3600 * kSecond;
		const auto odometry = transform_of(future, "odom", "base_link", mrpt::poses::CPose3D());
		if (is_message)
			drive.live.add_odometry({odometry, {}});
		else
			drive.live.add_transforms({odometry}, false);
		for (int i = 0; i < 1000; i++) drive.live.add_tracker_pose({future + i, "map"}, mrpt::poses::CPose3D(9, 9, 0));
		drive.steps(20);
		EXPECT_EQ(drive.seeds.size(), 1U);
		EXPECT_EQ(drive.summary(), "localized, and the tracker fits");
		drive.live.request();
		drive.step();
		ASSERT_EQ(drive.seeds.size(), 2U);
		EXPECT_EQ(drive.seeds.back().first.time, drive.robot.time) << is_message;
		EXPECT_LT(distance_between(drive.seeds.back().first.pose, drive.robot.pose), 0.1);
	}
}

/// More than are kept, by peers that have gone since.
TEST(LiveLocalizer, FindsTheRobotAmongAnyNumberOfFrames)
{
	Drive drive;
	drive.add_map(drive.grid);
	drive.live.set_tracker_readers(1, 1);
	int named = 0;
	const auto tell_others = [&](PublisherId publisher, int count, bool are_static)
	{
		std::vector<ros::Transform> others;
		for (int i = 0; i < count; i++, named++)
			others.push_back(transform_of(drive.robot.time, "f", "f" + std::to_string(named), {1, 2, 3, 0, 0, 0}));
		drive.live.hear(publisher);
		drive.live.add_transforms(others, are_static);
		drive.live.hear(1);
	};
	ros::LaserScan scan = drive.robot.scan();
	for (int i = 0; i < 12'000; i++)
	{
		scan.header.frame = "frame" + std::to_string(i);
		scan.ranges.resize(1);
		drive.live.add_scan("/scan", scan);
		if (i % 1000 == 0) drive.update(drive.robot.time += kSecond);
	}
	drive.update(drive.robot.time += kSecond);
	for (PublisherId peer = 10; peer < 30; peer++) tell_others(peer, 1000, peer % 2 == 0);
	drive.live.add_transforms(drive.robot.laser_transform(), true);
	drive.steps(10);
	ASSERT_EQ(drive.seeds.size(), 1U) << drive.summary();
	tell_others(40, 20'000, true);
	for (int i = 0; i < 5; i++)
	{
		tell_others(40, 1000, i % 2 == 0);
		EXPECT_TRUE(drive.step()) << "one peer cannot fill the room";
	}
	for (PublisherId peer = 50; peer < 70; peer++) tell_others(peer, 1000, peer % 2 == 0);
	drive.steps(20);
	EXPECT_EQ(drive.summary(), "localized, and the tracker fits");
}

TEST(LiveLocalizer, DoesNotSeedByOldOdometryUnlessTheRobotStands)
{
	Drive drive;
	drive.begin();
	drive.steps(2, 0.03, 0);
	drive.has_odometry = false;
	drive.robot.time += kSecond;
	drive.live.set_odometry_publishers(1);
	for (int i = 0; i < 10; i++)  // the scans that waited are answered later
	{
		drive.step(0.1, 0);
		drive.update(drive.robot.time + kSecond / 4);
	}
	EXPECT_TRUE(drive.seeds.empty());
	for (int i = 0; i < 10; i++) drive.step(0, 0);
	ASSERT_EQ(drive.seeds.size(), 1U);
	EXPECT_LT(distance_between(drive.seeds.front().first.pose, drive.robot.pose), 0.1);
}

TEST(LiveLocalizer, SeedsWithTheScansStampWhereNobodyPublishesOdometry)
{
	Drive drive;
	drive.has_odometry = false;
	drive.begin();
	drive.steps(10);
	ASSERT_FALSE(drive.seeds.empty());
	const auto& [seed, truth] = drive.seeds.front();
	EXPECT_LT(distance_between(seed.pose, truth), 0.1);
}

TEST(LiveLocalizer, SeedsWithTheScansStampIfTheOdometryHasAnotherClock)
{
	for (const Time off : {-8'310'659 * kSecond, 200 * kSecond})
	{
		Drive drive;
		drive.has_odometry = false;
		drive.begin();
		drive.live.set_odometry_publishers(1);
		const auto tell = [&](Time time)
		{
			const mrpt::poses::CPose3D odometry(drive.robot.odometry);
			drive.live.add_odometry({transform_of(time + off, "odom", "base_link", odometry), {}});
		};
		for (int i = 0; i < 20; i++)
		{
			tell(drive.robot.time + kStep);
			drive.step(0.05, 0.1);
		}
		ASSERT_EQ(drive.seeds.size(), 1U) << off;
		const auto& [seed, truth] = drive.seeds.front();
		EXPECT_EQ(seed.time % kStep, drive.robot.time % kStep);
		EXPECT_GT(seed.time, drive.robot.time - 20 * kStep);
		EXPECT_LE(seed.time, drive.robot.time);
		EXPECT_LT(distance_between(seed.pose, truth), 0.1);
		EXPECT_TRUE(drive.was_told("off those of the scans, as by another clock"));
		EXPECT_FALSE(drive.live.has_odometry());
	}
}

TEST(LiveLocalizer, DoesNotSeedByOdometryThatWentSilentLongAgo)
{
	Drive drive;
	drive.begin();
	drive.live.set_odometry_publishers(1);
	drive.live.set_tracker_readers(0, 0);
	drive.steps(10);
	drive.has_odometry = false;
	drive.robot.time += 200 * kSecond;
	drive.live.set_tracker_readers(1, 1);
	for (int i = 0; i < 20; i++) drive.step(0.05, 0.1);
	EXPECT_TRUE(drive.seeds.empty());
	EXPECT_FALSE(drive.was_told("another clock"));
}

TEST(LiveLocalizer, AnswersBeforeTheNextReadingOfOdometryIfThatTellsNothingNew)
{
	Drive drive;
	drive.begin();
	const auto roll = [&](double ahead, Time time)
	{
		drive.robot.time += time;
		drive.robot.move(ahead, 0);
		drive.live.add_transforms(drive.robot.odometry_transform(), false);
		drive.update(drive.robot.time);
	};
	const auto is_answered_after = [&](Time time)
	{
		drive.robot.time += time;
		drive.live.add_scan("/scan", drive.robot.scan());
		return drive.update(drive.robot.time).has_value();
	};
	for (int i = 0; i < 20; i++) roll(0.005, kSecond / 50);
	EXPECT_TRUE(is_answered_after(kSecond / 51)) << "at 50 Hz";
	roll(0.01, kSecond / 51);
	EXPECT_FALSE(is_answered_after(kSecond / 10)) << "a robot that moves may stop";
	for (int i = 0; i < 20; i++) roll(0, kSecond / 50);
	EXPECT_TRUE(is_answered_after(kSecond / 10)) << "a robot that stands";
}

TEST(LiveLocalizer, GoesByMessagesOfOdometryWithoutTransforms)
{
	Drive drive;
	drive.has_odometry = false;
	drive.begin();
	for (int i = 0; i < 10; i++)
	{
		ros::Odometry message;
		message.pose =
		    transform_of(drive.robot.time + kStep, "odom", "base_link", mrpt::poses::CPose3D(drive.robot.odometry));
		drive.live.add_odometry(message);
		drive.step(0, 0);
	}
	ASSERT_EQ(drive.seeds.size(), 1U);
	EXPECT_EQ(drive.summary(), "localized, and the tracker fits");
}

TEST(LiveLocalizer, StartsAgainWhenTheClockRunsBackAndKeepsTheMap)
{
	Drive drive;
	drive.begin();
	drive.steps(10);
	const Time start = drive.robot.time;
	drive.robot.time -= 60 * kSecond;
	drive.tracker = {};
	drive.robot.odometry = {};
	drive.live.update(drive.robot.time);
	EXPECT_LT(drive.robot.time, start);
	drive.step();
	EXPECT_TRUE(drive.was_told("the clock ran back"));
	drive.steps(10);
	EXPECT_EQ(drive.live.indices_built(), 1);
	EXPECT_EQ(drive.summary(), "localized") << "its tracker was told before";
	drive.live.set_tracker_readers(1, 2);
	drive.steps(5);
	EXPECT_EQ(drive.seeds.size(), 2U);
}

TEST(LiveLocalizer, TellsOnceThatTheClockRanBackWhateverComesFirst)
{
	const auto count_told = [](const Drive& drive)
	{
		return std::count(
		    drive.news.begin(), drive.news.end(), "the clock ran back: transforms, window and watch start again");
	};
	for (const bool scan_comes_first : {true, false})
	{
		Drive drive;
		drive.begin();
		drive.steps(10);
		const auto late = drive.robot.scan();
		drive.robot.time -= 5 * kSecond;
		if (!scan_comes_first) drive.update(drive.robot.time);
		if (!scan_comes_first) drive.live.add_scan("/scan", late);
		if (!scan_comes_first)
			drive.live.add_transforms({transform_of(late.header.time, "odom", "base_link", {})}, false);
		drive.steps(10);
		EXPECT_EQ(count_told(drive), 1) << scan_comes_first;
		EXPECT_EQ(drive.live.update(drive.robot.time).size(), 0U);
		EXPECT_TRUE(drive.step()) << "its transforms are still there";
	}
}
