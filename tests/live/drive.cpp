// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A simulated robot for long runs of d2s1r-live: d2s1r-live-drive MAP SECONDS [MARKERS.json]. It wanders through the
// map, publishes map, transforms and scans at 10 Hz, has a tracker that takes seeds, and is carried away once a minute.
// It drives in the domain ROS_DOMAIN_ID (0 if that is not set), or D2S1R_TEST_DOMAIN.
// The file gets the markers with the most hypotheses, the last of these.
#include <d2s1r/map_io.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <thread>
#include <utility>
#include <vector>

#include "fastdds_peer.h"

namespace d2s1r::test
{
namespace
{
constexpr double kRate = 10;               // [Hz]
constexpr double kStep = 0.05;             // [m] ahead between two scans
constexpr double kClearance = 0.4;         // [m] to walls
constexpr double kRight = 0.1;             // [m] of an answer
constexpr int kScansBetweenKidnaps = 600;  // [-]

/// Says how often the robot's tracker was right.
struct Drive
{
	int scans = 0, kidnaps = 0, seeds = 0, right = 0;
	int answers = 0, right_answers = 0;  //!< poses on /d2s1r/pose; those within kRight
	std::vector<double> milliseconds;    //!< from a scan to its pose
	MarkersType::type markers;           //!< with the most hypotheses
};

/// Returns how many hypotheses markers show.
long arrows_in(const MarkersType::type& markers)
{
	const auto& all = markers.markers();
	return std::count_if(
	    all.begin(), all.end(), [](const auto& marker) { return marker.type() == 0 && marker.scale().x() > 0; });
}

/// Writes what a viewer would draw: poses [m, rad], texts, and points [m], map frame.
void save(const MarkersType::type& markers, const std::string& file)
{
	std::ofstream out(file);
	out << "[";
	const char* separator = "";
	for (const auto& marker : markers.markers())
	{
		const auto& [position, turn] = std::pair(marker.pose().position(), marker.pose().orientation());
		out << std::exchange(separator, ",\n") << "{\"type\": " << marker.type()
		    << ", \"length\": " << marker.scale().x() << ", \"x\": " << position.x() << ", \"y\": " << position.y()
		    << ", \"yaw\": " << 2 * std::atan2(turn.z(), turn.w()) << ", \"text\": \"" << marker.text()
		    << "\", \"color\": [" << marker.color().r() << ", " << marker.color().g() << ", " << marker.color().b()
		    << ", " << marker.color().a() << "], \"points\": [";
		for (std::size_t i = 0; i < marker.points().size(); i++)
			out << (i > 0 ? ", " : "") << "[" << marker.points()[i].x() << ", " << marker.points()[i].y() << "]";
		out << "]}";
	}
	out << "]\n";
}

/// Returns whether there is room for the robot ahead.
bool is_free_ahead(const SimulatedRobot& robot)
{
	for (const double angle : {-0.6, -0.3, 0.0, 0.3, 0.6})
		if (cast_exactly(robot.world, robot.pose.x(), robot.pose.y(), robot.pose.phi() + angle, 1) < 2 * kClearance)
			return false;
	return true;
}

/// Publishes what the robot has now, and waits for the pose of its scan until the next one is due.
void publish(RobotPeer& peer, const SimpleTracker& tracker, std::chrono::steady_clock::time_point next, Drive& result)
{
	using namespace std::chrono;
	SimulatedRobot& robot = peer.robot;
	robot.time = duration_cast<nanoseconds>(system_clock::now().time_since_epoch()).count();
	peer.publish_odometry();
	if (const auto pose = tracker.pose(robot.odometry)) peer.tracker_pose.write(to_peer(robot.time, "map", *pose));
	if (!peer.ask(duration<double>(next - steady_clock::now()).count())) return;
	result.answers++;
	result.right_answers += distance_between(*peer.answer, robot.pose) < kRight ? 1 : 0;
}

Drive drive(const Grid& grid, int scans)
{
	RobotPeer peer(grid);
	PeerReader<PoseType> seeds(peer.peer, "/initialpose");
	PeerReader<MarkersType> markers(peer.peer, "/d2s1r/markers", {true, true, 1});
	SimulatedRobot& robot = peer.robot;
	robot.world = grid;  // walls of one cell stay
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
		for (const auto& drawn : markers.take())
			if (arrows_in(drawn) >= arrows_in(result.markers)) result.markers = drawn;
		next += std::chrono::milliseconds(static_cast<int>(1000 / kRate));
		publish(peer, tracker, next, result);
		const auto tracked = tracker.pose(robot.odometry);
		if (tracked && distance_between(*tracked, robot.pose) < 1) result.right++;
		std::this_thread::sleep_until(next);
	}
	result.seeds = tracker.seeds;
	result.milliseconds = peer.milliseconds;
	std::sort(result.milliseconds.begin(), result.milliseconds.end());
	return result;
}
}  // namespace
}  // namespace d2s1r::test

int main(int argc, char** argv)
try
{
	if (argc != 3 && argc != 4) throw std::runtime_error("usage: d2s1r-live-drive MAP SECONDS [MARKERS.json]");
	const char* const domain = std::getenv("ROS_DOMAIN_ID");  // as d2s1r-live does
	setenv("D2S1R_TEST_DOMAIN", domain != nullptr && *domain != '\0' ? domain : "0", 0);
	const auto map = d2s1r::load_map(argv[1]);
	const auto grid = d2s1r::make_grid(*map, {});
	const auto result = d2s1r::test::drive(grid, static_cast<int>(10 * std::atof(argv[2])));
	if (argc == 4) d2s1r::test::save(result.markers, argv[3]);
	std::cout << result.scans << " scans, " << result.kidnaps << " times carried away, " << result.seeds
	          << " seeds; the tracker was right (1 m) at " << result.right << " scans; " << result.answers
	          << " poses, of which right (0.1 m) " << result.right_answers;
	if (const auto& times = result.milliseconds; !times.empty())
		std::cout << ", from a scan to its pose " << times[times.size() / 2] << " ms in the median, at most "
		          << times.back() << " ms";
	if (result.answers == 0) std::cout << "; does d2s1r-live run in domain " << d2s1r::test::test_domain() << '?';
	std::cout << std::endl;
	return 0;
}
catch (const std::exception& e)
{
	std::cerr << e.what() << '\n';
	return 1;
}
