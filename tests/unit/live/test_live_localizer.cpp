// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The rules by which a running robot is told where it is, with times that the tests say.
#include <mutex>

#include "live/live_drive.h"

using namespace d2s1r;
using namespace d2s1r::test;
using namespace d2s1r::live;

TEST(LiveLocalizer, FindsTheRobotAndTellsItsTrackerOnce)
{
	Drive drive;
	drive.begin();
	drive.steps(20);
	ASSERT_EQ(drive.seeds.size(), 1U);
	const auto& [seed, truth] = drive.seeds.front();
	EXPECT_LT(distance_between(seed.pose, truth), 0.1);
	EXPECT_EQ(seed.frame, "map");
	EXPECT_GE(seed.covariance(0, 0), 0.3 * 0.3) << "inflated: a tracker must be able to move";
	EXPECT_GE(seed.covariance(2, 2), 0.1 * 0.1);
	EXPECT_EQ(drive.summary(), "localized, and the tracker fits");
	EXPECT_TRUE(drive.was_told("found /scan of 'laser' at x 0.200"));
	EXPECT_EQ(drive.live.indices_built(), 1);
}

TEST(LiveLocalizer, TellsNothingByFewerScansThanItWasAskedFor)
{
	Drive drive;
	drive.begin();
	drive.steps(3);
	EXPECT_TRUE(drive.seeds.empty());
	drive.step();
	EXPECT_EQ(drive.seeds.size(), 1U);
}

TEST(LiveLocalizer, IsSilentWithoutAMap)
{
	Drive drive;
	drive.live.add_transforms(drive.robot.laser_transform(), true);
	drive.live.set_tracker_readers(1, 1);
	EXPECT_FALSE(drive.step());
	EXPECT_EQ(drive.summary(), "waits for a map");
}

TEST(LiveLocalizer, IndexesTheSameMapOnce)
{
	Drive drive;
	drive.begin();
	for (int i = 0; i < 3; i++) drive.add_map(drive.grid);
	drive.add_map(drive.grid, 2);  // the publisher was started again
	EXPECT_EQ(drive.live.indices_built(), 1);
}

TEST(LiveLocalizer, UsesTheMapBeforeWhileAnotherOneIsIndexedAndSeedsAnewThere)
{
	Drive drive;
	drive.begin();
	drive.steps(10);
	Grid moved = drive.grid;
	moved.origin_x += 2;
	drive.live.add_map(map_message(moved), 1);
	EXPECT_TRUE(drive.step()) << "in either map";
	EXPECT_TRUE(drive.was_told("another map came"));
	drive.live.wait_for_index();
	drive.tracker = {};
	drive.steps(10);
	ASSERT_EQ(drive.seeds.size(), 2U);
	const auto& [seed, truth] = drive.seeds.back();
	EXPECT_LT(distance_between(seed.pose, mrpt::poses::CPose2D(2, 0, 0) + truth), 0.1);
	EXPECT_EQ(drive.live.indices_built(), 2);
}

/// A killed tracker's reader of seeds stays until its lease has run out, and its last pose would still fit.
TEST(LiveLocalizer, SeedsATrackerThatWasKilledAndStartedAgain)
{
	for (const Seeding seeding : {Seeding::kOnce, Seeding::kWatch})
		for (const int seconds : {2, 6, 15})
		{
			Drive drive(watching(seeding));
			drive.begin();
			drive.steps(40);
			int ever = 1;
			for (int crash = 0; crash < 10; crash++)
			{
				const std::size_t before = drive.seeds.size();
				drive.tracker = {};         // it says nothing any more
				constexpr int kLease = 10;  // [s]
				drive.wait(std::min(seconds, kLease));
				if (seconds > kLease) drive.live.set_tracker_readers(0, ever);
				drive.wait(std::max(0, seconds - kLease));
				EXPECT_EQ(drive.seeds.size(), before) << "there is nobody to tell";
				drive.live.set_tracker_readers(seconds < kLease ? 2 : 1, ++ever);
				drive.steps(10);
				ASSERT_EQ(drive.seeds.size(), before + 1) << "within a second, after " << seconds << " s";
				const auto& [seed, truth] = drive.seeds.back();
				EXPECT_LT(distance_between(seed.pose, truth), 0.1);
				drive.wait(kLease);
				drive.live.set_tracker_readers(1, ever);
				drive.steps(20);
				EXPECT_EQ(drive.seeds.size(), before + 1) << "it took the seed";
			}
		}
}

TEST(LiveLocalizer, LeavesATrackerAloneWhenSomebodyElseReadsSeeds)
{
	Drive drive;
	drive.begin();
	drive.steps(40);
	ASSERT_EQ(drive.seeds.size(), 1U);
	drive.live.set_tracker_readers(2, 2);
	drive.steps(50);
	EXPECT_EQ(drive.seeds.size(), 1U) << "the tracker's pose fits";
}

/// A map that a robot makes while it drives changes faster than it can be indexed.
TEST(LiveLocalizer, UsesEachMapThatIsIndexedWhileOthersCome)
{
	LiveSettings settings;
	std::mutex indexing;
	settings.make_localizer = [&](const auto& grid, const Parameters& parameters) -> MadeLocalizer
	{
		const std::lock_guard wait(indexing);
		return {std::make_shared<Localizer>(grid, parameters), "indexed one"};
	};
	Drive drive(settings);
	drive.begin();
	Grid changed = drive.grid;
	const auto change = [&]
	{
		changed.origin_x += 1;
		drive.live.add_map(map_message(changed), 1);
	};
	{
		const std::lock_guard wait(indexing);
		for (int i = 0; i < 3; i++) change();
		ASSERT_TRUE(drive.step()) << "in the map before";
		EXPECT_EQ(drive.live.indices_built(), 1);
	}
	drive.live.wait_for_index();  // of the first change
	change();
	ASSERT_TRUE(drive.step());
	EXPECT_EQ(drive.live.indices_built(), 2) << "the newest map is not waited for";
	drive.live.wait_for_index();
	const auto answer = drive.step();
	ASSERT_TRUE(answer);
	EXPECT_EQ(drive.live.indices_built(), 3) << "the second and the third change were never the newest";
	EXPECT_LT(
	    distance_between(answer->localization.best().pose, mrpt::poses::CPose2D(4, 0, 0) + drive.robot.pose), 0.1);
	EXPECT_TRUE(drive.was_told("indexed one"));
}

TEST(LiveLocalizer, KeepsTheMapOfTheFirstOfTwoPublishersAndTellsIt)
{
	Drive drive;
	drive.begin();
	Grid other = drive.grid;
	other.origin_x += 2;
	drive.live.set_map_publishers({1, 2});
	for (int i = 0; i < 3; i++) drive.live.add_map(map_message(other), 2);
	const auto answer = drive.step();
	ASSERT_TRUE(answer);
	EXPECT_LT(distance_between(answer->localization.best().pose, drive.robot.pose), 0.1);
	EXPECT_EQ(
	    std::count_if(
	        drive.news.begin(), drive.news.end(),
	        [](const std::string& line) { return line.find("a second publisher of maps") == 0; }),
	    1);
	drive.live.set_map_publishers({2});
	drive.live.add_map(map_message(other), 2);
	EXPECT_TRUE(drive.live.is_indexing()) << "the first one is gone";
}

TEST(LiveLocalizer, RefusesMapsOfNonsenseWithALine)
{
	Drive drive;
	drive.begin();
	ros::OccupancyGrid wrong = map_message(drive.grid);
	wrong.percent.pop_back();
	const auto add = [&](const ros::OccupancyGrid& map)
	{
		drive.live.add_map(map, 1);
		drive.live.wait_for_index();
		EXPECT_TRUE(drive.step()) << "the map before is used";
	};
	add(wrong);
	wrong.width = wrong.height = 0;
	add(wrong);
	ros::OccupancyGrid infinite = map_message(drive.grid);
	infinite.resolution = std::nan("");
	add(infinite);
	EXPECT_TRUE(drive.was_told("cells and says that it has"));
	EXPECT_TRUE(drive.was_told("the map has no cells"));
	EXPECT_EQ(drive.live.indices_built(), 1);
	EXPECT_FALSE(drive.live.is_indexing());
}

TEST(LiveLocalizer, NeverSeedsWhatIsAmbiguous)
{
	// Two rooms that are alike: nothing tells in which of them the robot is.
	const Grid twins = make_building(
	    {"#################", "#.......#.......#", "#.......#.......#", "#..##...#..##...#", "#.......#.......#",
	     "#......##......##", "#.......#.......#", "#################"});
	Drive drive(watching(), twins);
	drive.robot.pose = mrpt::poses::CPose2D(2.9, 1.3, 0.4);
	drive.begin();
	for (int i = 0; i < 40; i++)
	{
		const auto answer = drive.step(0.0, 0.1);
		ASSERT_TRUE(answer);
		EXPECT_NE(answer->localization.status, Status::kLocalized);
	}
	EXPECT_TRUE(drive.seeds.empty());
	EXPECT_EQ(drive.summary(), "several places explain the scan");
}

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

TEST(LiveLocalizer, TellsWhoseMessageALineIsAbout)
{
	Drive drive;
	drive.begin();
	drive.live.hear(7);
	drive.live.add_tracker_pose({drive.robot.time, "other"}, mrpt::poses::CPose3D());
	drive.live.hear(8);
	ros::LaserScan scan = drive.robot.scan();
	scan.header.frame = "nowhere";
	drive.live.add_scan("/scan", scan);
	drive.live.hear(9);
	drive.live.update(drive.robot.time);
	drive.live.update(drive.robot.time + kSecond);
	const auto lines = drive.live.take_news();
	ASSERT_EQ(lines.size(), 2U);
	EXPECT_EQ(lines[0].text.find("the tracker's pose is in 'other'"), 0U);
	EXPECT_EQ(lines[0].peer, 7U);
	EXPECT_EQ(lines[1].text.find("no transform from the laser's frame 'nowhere'"), 0U);
	EXPECT_EQ(lines[1].peer, 8U);
}

TEST(LiveLocalizer, SeedsATrackerThatStartsLater)
{
	Drive drive;
	drive.begin();
	drive.live.set_tracker_readers(0, 0);
	Drive late;
	late.add_map(late.grid);
	late.live.add_transforms(late.robot.laser_transform(), true);
	late.steps(20);
	EXPECT_TRUE(late.seeds.empty()) << "nobody would hear it";
	EXPECT_EQ(late.summary(), "localized");
	late.live.set_tracker_readers(1, 1);
	late.step();
	ASSERT_EQ(late.seeds.size(), 1U);
	late.steps(20);
	EXPECT_EQ(late.seeds.size(), 1U);
	late.live.set_tracker_readers(0, 1);  // killed and started again
	late.tracker = {};
	late.steps(10);
	late.live.set_tracker_readers(1, 2);
	late.steps(10);
	EXPECT_EQ(late.seeds.size(), 2U);
}

TEST(LiveLocalizer, RepeatsASeedThreeTimesAndThenTellsAnError)
{
	Drive drive;
	drive.takes_seeds = false;
	drive.tracker.map_to_odometry = mrpt::poses::CPose2D(1, 1, 0);
	drive.begin();
	drive.steps(150, 0, 0);
	EXPECT_EQ(drive.seeds.size(), 4U);
	EXPECT_EQ(drive.live.status(drive.robot.time).level, LiveStatus::Level::kError);
	EXPECT_NE(drive.summary().find("told 4 times"), std::string::npos) << drive.summary();
	drive.takes_seeds = true;
	drive.live.request();
	drive.steps(5, 0, 0);
	EXPECT_EQ(drive.seeds.size(), 5U) << "somebody asked";
	EXPECT_EQ(drive.summary(), "localized, and the tracker fits");
}

TEST(LiveLocalizer, TellsThatNoPoseOfTheTrackerAnswers)
{
	Drive drive;
	drive.tells_pose = false;
	drive.begin();
	drive.steps(150, 0, 0.02);
	EXPECT_EQ(drive.seeds.size(), 4U);
	EXPECT_NE(drive.summary().find("no pose of it says that it took it"), std::string::npos) << drive.summary();
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

TEST(LiveLocalizer, SaysThatATrackerIsLostAndSeedsItOnlyIfAsked)
{
	for (const Seeding seeding : {Seeding::kOnce, Seeding::kWatch, Seeding::kNever})
	{
		Drive drive(watching(seeding));
		drive.begin();
		drive.tracker.map_to_odometry = drive.robot.pose;
		drive.steps(30, 0, 0.02);
		EXPECT_EQ(drive.summary(), "localized, and the tracker fits");
		EXPECT_TRUE(drive.seeds.empty()) << "it knows already";
		drive.robot.pose = mrpt::poses::CPose2D(poses_on_floor().at(6));  // carried there
		drive.steps(5, 0, 0.02);
		if (seeding == Seeding::kWatch)
		{
			ASSERT_EQ(drive.seeds.size(), 1U);
			EXPECT_LT(distance_between(drive.seeds.front().first.pose, drive.seeds.front().second), 0.1);
			drive.steps(5, 0, 0.02);
			EXPECT_EQ(drive.summary(), "localized, and the tracker fits");
			continue;
		}
		EXPECT_TRUE(drive.seeds.empty());
		EXPECT_EQ(drive.live.status(drive.robot.time).level, LiveStatus::Level::kWarning);
		EXPECT_EQ(drive.summary().find("the tracker is lost: "), 0U) << drive.summary();
	}
}

TEST(LiveLocalizer, ReadsTheTrackersPoseFromTransforms)
{
	Drive drive(watching());
	drive.tells_pose = false;
	drive.begin();
	drive.tracker.map_to_odometry = mrpt::poses::CPose2D(5, 1, 1);
	for (int i = 0; i < 10; i++)
	{
		const mrpt::poses::CPose3D pose(*drive.tracker.map_to_odometry);
		drive.live.add_transforms({transform_of(drive.robot.time + kSecond, "map", "odom", pose)}, false);
		drive.step(0, 0.02);
	}
	EXPECT_EQ(drive.seeds.size(), 1U) << drive.summary();
}

TEST(LiveLocalizer, TellsThatATrackersPoseIsInAnotherFrame)
{
	Drive drive;
	drive.begin();
	drive.live.add_tracker_pose({drive.robot.time, "other"}, mrpt::poses::CPose3D());
	drive.step();
	EXPECT_TRUE(drive.was_told("the tracker's pose is in 'other', which is not the map's frame"));
}

TEST(LiveLocalizer, LocalizesAsManyScansAsItMay)
{
	LiveSettings settings;
	settings.most_scans = 2;
	Drive drive(settings);
	drive.begin();
	int answers = 0;
	for (int i = 0; i < 20; i++) answers += drive.step() ? 1 : 0;
	EXPECT_EQ(answers, 4);
}

TEST(LiveLocalizer, UsesTheScansOfAllLasersTogether)
{
	LiveSettings settings;
	settings.merge_lasers = true;
	Drive drive(settings);
	drive.begin();
	const auto half = [&](bool ahead)  // each laser sees one half
	{
		ros::LaserScan scan = drive.robot.scan();
		for (std::size_t i = 0; i < scan.ranges.size(); i++)
			if ((i >= scan.ranges.size() / 2) != ahead) scan.ranges[i] = std::nanf("");
		return scan;
	};
	const auto returns_of_front = [&]
	{
		drive.live.add_transforms(drive.robot.odometry_transform(), false);
		drive.live.add_scan("/front", half(true));
		const auto answer = drive.update(drive.robot.time);
		if (!answer || answer->localization.status != Status::kLocalized) return std::ptrdiff_t(0);
		return std::count_if(
		    answer->scan.beams.begin(), answer->scan.beams.end(), [](const Beam& beam) { return beam.is_return; });
	};
	returns_of_front();
	drive.live.add_scan("/rear", half(false));
	drive.update(drive.robot.time);
	const auto both = returns_of_front();
	EXPECT_GT(both, 170);
	for (int i = 0; i < 6; i++) drive.robot.time += kStep, drive.robot.move(0.03, 0.15);  // the rear one says no more
	const auto one = returns_of_front();
	EXPECT_GT(one, 80);
	EXPECT_LT(one, 95) << "what a laser saw 0.6 s ago is left out";
	drive.robot.time += kStep;
	drive.live.add_transforms(drive.robot.odometry_transform(), false);
	drive.live.add_scan("/rear", half(false));
	drive.update(drive.robot.time);
	EXPECT_EQ(returns_of_front(), both) << "it is back";
}

TEST(LiveLocalizer, TakesAnAtlasInsteadOfMessages)
{
	LiveSettings settings;
	settings.has_maps_of_its_own = true;
	Drive drive(settings);
	drive.live.add_transforms(drive.robot.laser_transform(), true);
	drive.live.set_tracker_readers(1, 1);
	drive.live.add_map(map_message(drive.grid), 1);
	drive.steps(10);
	EXPECT_TRUE(drive.seeds.empty()) << "its own maps may take long to load";
	EXPECT_TRUE(drive.was_told("somebody publishes a map, too"));
	auto localizer = std::make_shared<Localizer>(make_map(drive.grid));
	drive.live.use_maps(std::make_shared<Atlas>(std::vector<AtlasMap>{{"floor", localizer}}));
	drive.steps(10);
	ASSERT_EQ(drive.seeds.size(), 1U);
	EXPECT_EQ(drive.seeds.front().first.frame, "map");
	EXPECT_EQ(drive.live.indices_built(), 0);
}

TEST(LiveLocalizer, LocalizesByPointClouds)
{
	LiveSettings settings;
	settings.cloud_height = ros::HeightBand{0.1, 1};
	Drive drive(settings);
	drive.begin();
	const auto cloud_of = [&](const ros::LaserScan& scan)
	{
		ros::PointCloud cloud{scan.header, {}};
		for (std::size_t i = 0; i < scan.ranges.size(); i++)
		{
			const float angle = scan.first_angle + static_cast<float>(i) * scan.angle_step;
			cloud.points.push_back({scan.ranges[i] * std::cos(angle), scan.ranges[i] * std::sin(angle), 0.2F});
			cloud.points.push_back({0.5F * std::cos(angle), 0.5F * std::sin(angle), -0.3F});  // the floor
		}
		return cloud;
	};
	for (int i = 0; i < 10; i++)
	{
		drive.robot.time += kStep;
		drive.robot.move(0.03, 0.15);
		drive.live.add_transforms(drive.robot.odometry_transform(), false);
		drive.live.add_cloud("/points", cloud_of(drive.robot.scan()));
		const auto answer = drive.update(drive.robot.time);
		ASSERT_TRUE(answer && answer->localization.status == Status::kLocalized) << drive.summary();
		EXPECT_LT(distance_between(answer->localization.best().pose, drive.robot.pose), 0.1);
	}
	EXPECT_EQ(drive.seeds.size(), 1U);
	Drive without;
	without.begin();
	without.live.add_cloud("/points", cloud_of(without.robot.scan()));
	EXPECT_FALSE(without.update(without.robot.time));
	EXPECT_TRUE(without.was_told("/points has point clouds, which are not used: set a cloud height"));
}
