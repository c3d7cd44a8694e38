// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Robots that drive through generated floors and are carried away, a tracker that only follows odometry and takes
// seeds, and LiveLocalizer between them. Time is simulated. Usage:
// kidnap_experiment DRIVES HOURS [SCANS_PER_SECOND [WINDOW]]; WINDOW [scans] are judged together (d2s1r-live's
// default).
#include <live/live_localizer.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "made_floors.h"
#include "office_floor.h"

namespace
{
using namespace d2s1r;
using namespace d2s1r::live;
using mrpt::poses::CPose2D;

constexpr double kRight = 0.5;  // [m] of a seed, and of a tracker

/// A floor as it is, its map, and the rays of it.
struct Building
{
	Building(Grid drawn, unsigned seed)
	    : map(std::move(drawn)), world(experiments::altered(map, seed)), caster(world, 30)
	{
	}
	Grid map;
	Grid world;  //!< in which some walls are others
	RayCaster caster;
};

/// Returns a floor and the same turned by half a turn beside it: every place has a twin.
Grid symmetric_floor(const Grid& half)
{
	Grid whole = half;
	whole.width = 2 * half.width;
	whole.cells.assign(static_cast<std::size_t>(whole.width) * static_cast<std::size_t>(whole.height), Cell::kUnknown);
	for (int y = 0; y < half.height; y++)
		for (int x = 0; x < half.width; x++)
		{
			whole.cells[static_cast<std::size_t>(whole.index(x, y))] = half.at(x, y);
			const int turned_x = whole.width - 1 - x, turned_y = whole.height - 1 - y;
			whole.cells[static_cast<std::size_t>(whole.index(turned_x, turned_y))] = half.at(x, y);
		}
	return whole;
}

ros::OccupancyGrid message_of(const Grid& grid)
{
	ros::OccupancyGrid map;
	map.header.frame = "map";
	map.resolution = grid.cell_size;
	map.width = static_cast<std::uint32_t>(grid.width);
	map.height = static_cast<std::uint32_t>(grid.height);
	map.origin = {grid.origin_x, grid.origin_y, 0};
	for (const Cell cell : grid.cells)
		map.percent.push_back(cell == Cell::kFree ? std::int8_t{0} : std::int8_t(cell == Cell::kOccupied ? 100 : -1));
	return map;
}

/// A robot that wanders, with its tracker.
struct Robot
{
	Robot(const Building& in, unsigned seed, double scans_per_second)
	    : building(in), random(seed), step(1 / scans_per_second)
	{
		carry_away();
	}

	void carry_away() { pose = CPose2D(experiments::open_pose_on(building.world, random)); }

	bool is_free(const CPose2D& at) const
	{
		const Grid& grid = building.world;
		return experiments::is_open(
		    grid, static_cast<int>((at.x() - grid.origin_x) / grid.cell_size),
		    static_cast<int>((at.y() - grid.origin_y) / grid.cell_size));
	}

	/// Drives on by 0.5 m/s; turns where it cannot.
	void move()
	{
		std::normal_distribution<double> error(1, 0.03), turn(0, 0.3);
		CPose2D motion(0.5 * step, 0, turn(random) * step);
		if (!is_free(pose + motion))
			motion = CPose2D(0, 0, turning * 0.8 * step);
		else if (random() % 50 == 0)
			turning = -turning;
		pose = pose + motion;
		odometry = odometry + CPose2D(motion.x() * error(random), 0, motion.phi() * error(random));
		time += static_cast<Time>(step * 1e9);
	}

	ros::LaserScan scan()
	{
		std::normal_distribution<double> noise(0, 0.01);
		constexpr int kBeams = 360;
		ros::LaserScan message;
		message.header = {time, "base_link"};
		message.first_angle = -static_cast<float>(M_PI);
		message.angle_step = static_cast<float>(2 * M_PI / kBeams);
		message.min_range = 0.05F;
		message.max_range = 29;
		for (int i = 0; i < kBeams; i++)
		{
			const float range = building.caster.cast(pose.x(), pose.y(), pose.phi() - M_PI + i * 2 * M_PI / kBeams);
			message.ranges.push_back(range + static_cast<float>(noise(random)));
		}
		return message;
	}

	const Building& building;
	std::mt19937 random;
	double step;  //!< [s]
	double turning = 1;
	CPose2D pose, odometry;
	std::optional<CPose2D> map_to_odometry;  //!< of the tracker
	Time time = 1'000'000 * kSecond;
};

struct Counts
{
	int scans = 0, localized = 0, wrong_scans = 0, seeds = 0, false_seeds = 0;
};

/// Drives with a LiveLocalizer.
class Drive
{
   public:
	Drive(const Building& building, unsigned seed, double scans_per_second, int window)
	    : robot(building, seed, scans_per_second), live_(settings(window))
	{
		live_.set_map_publishers({1});
		live_.add_map(message_of(building.map), 1);
		live_.wait_for_index();
		live_.set_tracker_readers(1, 1);
	}

	/// \return whether the scan was localized
	bool step(Counts& counts)
	{
		robot.move();
		live_.add_transforms({{{robot.time, "odom"}, "base_link", mrpt::poses::CPose3D(robot.odometry)}}, false);
		if (robot.map_to_odometry)
			live_.add_tracker_pose({robot.time, "map"}, mrpt::poses::CPose3D(*robot.map_to_odometry + robot.odometry));
		live_.add_scan("/scan", robot.scan());
		bool localized = false;
		for (const ScanAnswer& answer : live_.update(robot.time))
		{
			counts.scans++;
			localized = answer.localization.status == Status::kLocalized;
			counts.localized += localized ? 1 : 0;
			counts.wrong_scans += localized && answer.localization.best().pose.distanceTo(robot.pose) > kRight ? 1 : 0;
			if (!answer.seed) continue;
			counts.seeds++;
			counts.false_seeds += answer.seed->pose.distanceTo(robot.pose) > kRight ? 1 : 0;
			robot.map_to_odometry = answer.seed->pose + (-robot.odometry);
		}
		live_.take_news();
		return localized;
	}

	bool tracker_is_right() const
	{
		return robot.map_to_odometry && (*robot.map_to_odometry + robot.odometry).distanceTo(robot.pose) < kRight;
	}

	/// Drives until the tracker is right, for at most `seconds`.
	/// \return [s] by the clock, and [s] since the first localized scan; none if the tracker was not right
	std::optional<std::pair<double, double>> repair(double seconds, Counts& counts)
	{
		std::optional<double> first;
		for (double passed = 0; passed < seconds; passed += robot.step)
		{
			if (step(counts) && !first) first = passed;
			if (tracker_is_right()) return std::pair(passed, passed - first.value_or(passed));
		}
		return std::nullopt;
	}

	Robot robot;

   private:
	static LiveSettings settings(int window)
	{
		LiveSettings settings;
		settings.window = window;
		settings.seeding = Seeding::kWatch;
		return settings;
	}
	LiveLocalizer live_;
};

void report_times(const char* what, std::vector<std::pair<double, double>> times, int cases)
{
	std::sort(times.begin(), times.end());
	std::vector<double> since;
	for (const auto& time : times) since.push_back(time.second);
	std::sort(since.begin(), since.end());
	if (times.empty()) return;
	const auto within = [](const std::vector<double>& all, double most)
	{ return std::count_if(all.begin(), all.end(), [&](double t) { return t <= most; }); };
	std::vector<double> all;
	for (const auto& time : times) all.push_back(time.first);
	std::printf(
	    "%s: %zu of %d; by the clock median %.1f s, longest %.1f s, within 1 s %td, within 3 s %td; since the first "
	    "localized scan median %.1f s, longest %.1f s, within 1 s %td, within 3 s %td\n",
	    what, times.size(), cases, all[all.size() / 2], all.back(), within(all, 1), within(all, 3),
	    since[since.size() / 2], since.back(), within(since, 1), within(since, 3));
}

void report(const char* what, const Counts& counts)
{
	std::printf(
	    "%s: %d scans, %d localized, of which wrong %d; seeds %d, false %d\n", what, counts.scans, counts.localized,
	    counts.wrong_scans, counts.seeds, counts.false_seeds);
	std::fflush(stdout);
}
}  // namespace

int main(int argc, char** argv)
{
	const int drives = argc > 1 ? std::atoi(argv[1]) : 50;
	const double hours = argc > 2 ? std::atof(argv[2]) : 10;
	const double rate = argc > 3 ? std::atof(argv[3]) : 2;
	const int window = argc > 4 ? std::atoi(argv[4]) : LiveSettings().window;
	std::vector<Building> buildings;
	buildings.reserve(3);
	for (const unsigned seed : {11U, 12U, 13U})
		buildings.emplace_back(
		    benchmark::make_office_floor(
		        seed == 11   ? 400
		        : seed == 12 ? 1200
		                     : 3750,
		        0.05, seed),
		    seed);
	Counts counts;
	std::vector<std::pair<double, double>> starts, kidnappings;
	int carried = 0;
	for (int i = 0; i < drives; i++)
	{
		Drive drive(buildings[static_cast<std::size_t>(i) % 3], static_cast<unsigned>(i) + 1, 10, window);
		if (const auto time = drive.repair(30, counts)) starts.push_back(*time);
		for (int kidnapping = 0; kidnapping < 2; kidnapping++)
		{
			for (int s = 0; s < 50; s++) drive.step(counts);
			const CPose2D before = drive.robot.pose;
			do drive.robot.carry_away();
			while (drive.robot.pose.distanceTo(before) < 1);
			carried++;
			if (const auto time = drive.repair(30, counts)) kidnappings.push_back(*time);
		}
	}
	report_times("starts", starts, drives);
	report_times("kidnappings repaired", kidnappings, carried);
	report("these drives", counts);
	Counts driven;
	for (std::size_t i = 0; i < buildings.size(); i++)
	{
		Drive drive(buildings[i], 100 + static_cast<unsigned>(i), rate, window);
		for (double passed = 0; passed < hours * 3600 / 3; passed += drive.robot.step) drive.step(driven);
		report("driven so far", driven);
	}
	const Building twins(symmetric_floor(benchmark::make_office_floor(400, 0.05, 14)), 0);
	Building exact = twins;
	exact.world = exact.map;
	exact.caster = RayCaster(exact.world, 30);
	Counts symmetric;
	Drive drive(exact, 200, rate, window);
	for (double passed = 0; passed < hours * 360; passed += drive.robot.step) drive.step(symmetric);
	report("symmetric building", symmetric);
	return driven.false_seeds + counts.false_seeds + symmetric.seeds == 0 ? 0 : 1;
}
