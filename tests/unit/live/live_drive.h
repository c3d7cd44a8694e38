// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A robot whose messages reach a LiveLocalizer.
#pragma once

#include "live/simulated_robot.h"

namespace d2s1r::test
{
using namespace d2s1r::live;

inline constexpr Time kStep = kSecond / 10;  // [ns] between scans, if a test does not say else

/// A robot in make_floor() whose messages reach a LiveLocalizer.
struct Drive
{
	explicit Drive(const LiveSettings& given = {}, const Grid& map = make_floor())
	    : settings(given), grid(map), live(given)
	{
		robot.world = world_of(grid);
		robot.pose = mrpt::poses::CPose2D(poses_on_floor().at(4));
	}

	/// The map, the laser and a tracker are there.
	void begin()
	{
		add_map(grid);
		live.add_transforms(robot.laser_transform(), true);
		live.set_tracker_readers(1, 1);
	}

	void add_map(const Grid& map, PublisherId publisher = 1)
	{
		live.set_map_publishers({publisher});
		live.add_map(map_message(map), publisher);
		live.wait_for_index();
		live.update(robot.time);
	}

	/// A step of the robot and its scan. \return the answer, if there is one
	std::optional<ScanAnswer> step(double ahead = 0.03, double turn = 0.15)
	{
		robot.time += period;
		robot.move(ahead, turn);
		if (has_odometry) live.add_transforms(robot.odometry_transform(), false);
		if (tells_pose)
			if (const auto pose = tracker.pose(robot.odometry))
				live.add_tracker_pose({robot.time, "map"}, mrpt::poses::CPose3D(*pose));
		live.add_scan("/scan", robot.scan());
		return update(robot.time);
	}

	/// \return the last answer, if there is one
	std::optional<ScanAnswer> update(Time now)
	{
		std::optional<ScanAnswer> last;
		for (ScanAnswer& answer : live.update(now))
		{
			if (answer.seed) seeds.push_back({*answer.seed, robot.pose});
			if (answer.seed && takes_seeds) tracker.take(*answer.seed, robot.odometry);
			last = std::move(answer);
		}
		for (const NewsLine& line : live.take_news()) news.push_back(line.text);
		return last;
	}

	void steps(int count, double ahead = 0.03, double turn = 0.15)
	{
		for (int i = 0; i < count; i++) step(ahead, turn);
	}

	/// Lets time pass with a scan each second.
	void wait(int seconds)
	{
		period = kSecond;
		steps(seconds);
		period = kStep;
	}

	bool was_told(const std::string& part) const
	{
		return std::any_of(
		    news.begin(), news.end(), [&](const std::string& line) { return line.find(part) != std::string::npos; });
	}

	std::string summary() const { return live.status(robot.time).summary; }

	LiveSettings settings;
	Grid grid;
	LiveLocalizer live;
	SimulatedRobot robot;
	SimpleTracker tracker;
	Time period = kStep;  //!< [ns] between scans
	bool has_odometry = true;
	bool tells_pose = true;
	bool takes_seeds = true;
	std::vector<std::pair<Seed, mrpt::poses::CPose2D>> seeds;  //!< with the true pose at that time
	std::vector<std::string> news;
};

inline LiveSettings watching(Seeding seeding = Seeding::kWatch)
{
	LiveSettings settings;
	settings.seeding = seeding;
	return settings;
}
}  // namespace d2s1r::test
