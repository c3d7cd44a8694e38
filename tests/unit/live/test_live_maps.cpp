// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The map that a running robot is looked for in.
#include <mutex>

#include "live/live_drive.h"

using namespace d2s1r;
using namespace d2s1r::test;
using namespace d2s1r::live;

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
