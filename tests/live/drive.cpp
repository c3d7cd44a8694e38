// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A simulated robot for long runs of d2s1r-live: d2s1r-live-drive MAP SECONDS. It wanders through the map, publishes
// map, transforms and scans at 10 Hz, has a tracker that takes seeds, and is carried away once a minute.
#include "fastdds_peer.h"

#include <d2s1r/map_io.h>

#include <cstdlib>
#include <iostream>
#include <thread>

namespace d2s1r::test
{
namespace
{
constexpr double kRate = 10;               // [Hz]
constexpr double kStep = 0.05;             // [m] ahead between two scans
constexpr double kClearance = 0.4;         // [m] to walls
constexpr int kScansBetweenKidnaps = 600;  // [-]

/// Says how often the robot's tracker was right.
struct Drive
{
	int scans = 0, kidnaps = 0, seeds = 0, right = 0;
};

/// Returns whether there is room for the robot ahead.
bool is_free_ahead(const SimulatedRobot& robot)
{
	for (const double angle : {-0.6, -0.3, 0.0, 0.3, 0.6})
		if (cast_exactly(robot.world, robot.pose.x(), robot.pose.y(), robot.pose.phi() + angle, 1) < 2 * kClearance)
			return false;
	return true;
}

void publish(RobotPeer& peer, const SimpleTracker& tracker)
{
	using namespace std::chrono;
	SimulatedRobot& robot = peer.robot;
	robot.time = duration_cast<nanoseconds>(system_clock::now().time_since_epoch()).count();
	peer.publish_odometry();
	peer.scans.write(to_peer(robot.scan()));
	if (const auto pose = tracker.pose(robot.odometry)) peer.tracker_pose.write(to_peer(robot.time, "map", *pose));
}

Drive drive(const Grid& grid, int scans)
{
	RobotPeer peer(grid);
	PeerReader<PoseType> seeds(peer.peer, "/initialpose");
	SimulatedRobot& robot = peer.robot;
	robot.beams = 360;
	const auto places = random_poses(robot.world, scans / kScansBetweenKidnaps + 1, kClearance, 1);
	robot.pose = mrpt::poses::CPose2D(places[0]);
	peer.begin();
	SimpleTracker tracker;
	Drive result;
	auto next = std::chrono::steady_clock::now();
	for (; result.scans < scans; result.scans++)
	{
		if (result.scans > 0 && result.scans % kScansBetweenKidnaps == 0)
			robot.pose = mrpt::poses::CPose2D(places.at(static_cast<std::size_t>(++result.kidnaps)));
		const bool is_free = is_free_ahead(robot);
		robot.move(is_free ? kStep : 0, is_free ? 0.01 : 0.1);
		for (const auto& seed : seeds.take()) tracker.take({0, "", pose_of(seed), {}}, robot.odometry);
		publish(peer, tracker);
		const auto tracked = tracker.pose(robot.odometry);
		if (tracked && distance_between(*tracked, robot.pose) < 1) result.right++;
		next += std::chrono::milliseconds(static_cast<int>(1000 / kRate));
		std::this_thread::sleep_until(next);
	}
	result.seeds = tracker.seeds;
	return result;
}
}  // namespace
}  // namespace d2s1r::test

int main(int argc, char** argv)
try
{
	if (argc != 3) throw std::runtime_error("usage: d2s1r-live-drive MAP SECONDS");
	const auto map = d2s1r::load_map(argv[1]);
	const auto grid = d2s1r::make_grid(*map, {});
	const auto result = d2s1r::test::drive(grid, static_cast<int>(10 * std::atof(argv[2])));
	std::cout << result.scans << " scans, " << result.kidnaps << " times carried away, " << result.seeds
	          << " seeds; the tracker was right (1 m) at " << result.right << " scans" << std::endl;
	return 0;
}
catch (const std::exception& e)
{
	std::cerr << e.what() << '\n';
	return 1;
}
