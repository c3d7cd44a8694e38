// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Which scans of a running robot are localized.
#include "live/live_drive.h"

using namespace d2s1r;
using namespace d2s1r::test;
using namespace d2s1r::live;

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
