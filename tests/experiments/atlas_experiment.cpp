// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// atlas_experiment sites ATLAS.yaml OUT_DIR STEP MAP=SCANS.rawlog,TRUTH.txt...
//   Localizes every STEP-th scan of each set, whose true map is MAP, in three ways: in the atlas, in MAP alone, and in
//   the atlas without MAP.
// atlas_experiment floors FLOORS TWINS QUERIES AREA FIELD_OF_VIEW
//   The same on generated floors of AREA [m^2], full circles or parts of them [deg] with 1 cm of noise. TWINS of each
//   TWINS + 1 floors differ from the first of them in 5 % of their walls.
// atlas_experiment elevators DRIVES AREA FIELD_OF_VIEW TWINS
//   Drives of 15 frames on each of three such floors, with an elevator from one to the next, followed by --fuse's
//   filter and by a window of 10 frames. The odometry is off by 3 % and stands still in the elevator.
//
// The first two print a line for each set: how often the map is right, map and pose (0.3 m, 5 deg) are, how often they
// are when the map is known, the share of frames called localized and how many of these are right, the share called
// localized without the true map, and the time of a scan in the atlas. OUT_DIR receives a table for each set and way in
// the form of frames.csv; a pose in a wrong map is left out there.
#include <d2s1r/atlas.h>
#include <d2s1r/map_io.h>
#include <d2s1r/window_localizer.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <deque>
#include <filesystem>
#include <fstream>
#include <random>
#include <stdexcept>

#include "CParticleFilterFusion.h"
#include "office_floor.h"
#include "ranges/ray_caster.h"
#include "recorded_run.h"

namespace
{
using namespace d2s1r;
using namespace d2s1r::experiments;

/// Returns what `localizer` says of a scan, with the processor's time [ms] in place of that of the clock, which others
/// on the machine lengthen.
template <class L>
Localization localize(const L& localizer, const mrpt::obs::CObservation2DRangeScan& scan)
{
	const std::clock_t start = std::clock();
	Localization result = localizer.localize(scan);
	result.times.total_ms = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
	return result;
}

/// A scan and where it was taken.
struct Question
{
	mrpt::obs::CObservation2DRangeScan::ConstPtr scan;
	mrpt::math::TPose2D truth;  //!< robot in map, m and rad
};

bool is_right(const Localization& result, const std::string& map, const mrpt::math::TPose2D& truth)
{
	if (result.hypotheses.empty() || result.best().map != map) return false;
	const auto& pose = result.best().pose;
	return std::hypot(pose.x() - truth.x, pose.y() - truth.y) < 0.3 &&
	       std::abs(mrpt::math::wrapToPi(pose.phi() - truth.phi)) < 5 * M_PI / 180;
}

/// Counts what the scans of a map came to.
struct Counts
{
	double frames = 0, right_map = 0, right = 0, right_if_known = 0, localized = 0, localized_right = 0,
	       localized_if_known = 0, localized_without = 0;
	std::vector<double> ms = {}, known_ms = {}, retrieval_ms = {}, settling_ms = {};
	std::vector<double> reliability = {};  //!< by tenth of confidence: frames, sum of confidence, right ones

	void operator+=(const Counts& other)
	{
		for (auto member :
		     {&Counts::frames, &Counts::right_map, &Counts::right, &Counts::right_if_known, &Counts::localized,
		      &Counts::localized_right, &Counts::localized_if_known, &Counts::localized_without})
			this->*member += other.*member;
		ms.insert(ms.end(), other.ms.begin(), other.ms.end());
		for (auto member : {&Counts::known_ms, &Counts::retrieval_ms, &Counts::settling_ms})
			(this->*member).insert((this->*member).end(), (other.*member).begin(), (other.*member).end());
		reliability.resize(30);
		for (std::size_t i = 0; i < other.reliability.size(); i++) reliability[i] += other.reliability[i];
	}
	void rely(const Localization& result, bool is_right_one)
	{
		reliability.resize(30);
		if (result.hypotheses.empty()) return;
		const auto bin = static_cast<std::size_t>(std::min(9.0, 10 * result.confidence));
		reliability[3 * bin] += 1;
		reliability[3 * bin + 1] += result.confidence;
		reliability[3 * bin + 2] += is_right_one ? 1 : 0;
	}
	/// Expected calibration error [-].
	double calibration_error() const
	{
		double sum = 0, count = 0;
		for (std::size_t bin = 0; 3 * bin < reliability.size(); bin++)
		{
			sum += std::abs(reliability[3 * bin + 1] - reliability[3 * bin + 2]);
			count += reliability[3 * bin];
		}
		return count > 0 ? sum / count : 0;
	}
};

double mean(const std::vector<double>& values)
{
	double sum = 0;
	for (const double value : values) sum += value;
	return sum / static_cast<double>(values.size());
}

void print(const std::string& name, Counts counts)
{
	std::sort(counts.ms.begin(), counts.ms.end());
	const auto percent = [&](double part) { return 100 * part / counts.frames; };
	std::printf(
	    "%-34s %6.0f %6.1f %6.1f %6.1f %6.1f %6.1f %6.1f %6.1f %6.3f %7.1f %7.1f %7.1f %7.1f %7.1f\n", name.c_str(),
	    counts.frames, percent(counts.right_map), percent(counts.right), percent(counts.right_if_known),
	    percent(counts.localized), 100 * counts.localized_right / std::max(1.0, counts.localized),
	    percent(counts.localized_if_known), percent(counts.localized_without), counts.calibration_error(),
	    mean(counts.ms), counts.ms[counts.ms.size() * 99 / 100], mean(counts.retrieval_ms), mean(counts.settling_ms),
	    mean(counts.known_ms));
	std::fflush(stdout);
}

void print_heading()
{
	std::printf(
	    "%-34s %6s %6s %6s %6s %6s %6s %6s %6s %6s %7s %7s %7s %7s %7s\n", "set", "frames", "map %", "pose %", "known%",
	    "loc %", "right%", "k loc%", "out %", "ECE", "ms", "p99", "search", "settle", "known");
}

/// Writes a row as frames.csv has it; a pose in a wrong map is left out.
void write_row(std::ofstream& file, const Question& question, const Localization& result, const std::string& map)
{
	file << mrpt::format("%.6f,%s,", mrpt::Clock::toDouble(question.scan->timestamp), to_string(result.status));
	if (!result.hypotheses.empty() && (result.best().map == map || map.empty()))
	{
		const auto& pose = result.best().pose;
		file << mrpt::format("%.6f,%.6f,%.6f,%.6f", pose.x(), pose.y(), pose.phi(), result.confidence);
	}
	else
		file << ",,,";
	file << mrpt::format(
	    ",%.3f,%s\n", result.times.total_ms, result.hypotheses.empty() ? "" : result.best().map.c_str());
}

/// An atlas and what is compared with it for the scans of one of its maps.
struct Ways
{
	const Atlas& atlas;
	const Localizer& known;
	std::optional<Atlas> without;  //!< no value if there is no other map
	std::string map;

	Ways(const Atlas& the_atlas, const std::string& the_map)
	    : atlas(the_atlas), known(*the_atlas.at(the_map).localizer), map(the_map)
	{
		std::vector<AtlasMap> others;
		for (const AtlasMap& one : atlas.maps())
			if (one.name != map) others.push_back(one);
		if (!others.empty()) without.emplace(std::move(others));
	}
};

/// \param tables for the atlas, the known map and the atlas without it; may be null
Counts ask(const Ways& ways, const std::vector<Question>& questions, std::ofstream* tables)
{
	Counts counts;
	for (const Question& question : questions)
	{
		const Localization result = localize(ways.atlas, *question.scan), known = localize(ways.known, *question.scan);
		const bool right = is_right(result, ways.map, question.truth);
		counts.frames += 1;
		counts.right_map += !result.hypotheses.empty() && result.best().map == ways.map ? 1 : 0;
		counts.right += right ? 1 : 0;
		counts.right_if_known += is_right(known, "", question.truth) ? 1 : 0;
		counts.rely(result, right);
		if (result.status == Status::kLocalized)
		{
			counts.localized += 1;
			counts.localized_right += right ? 1 : 0;
		}
		counts.localized_if_known += known.status == Status::kLocalized ? 1 : 0;
		counts.ms.push_back(result.times.total_ms);
		counts.retrieval_ms.push_back(result.times.retrieval_ms);
		counts.settling_ms.push_back(result.times.registration_ms);
		counts.known_ms.push_back(known.times.total_ms);
		Localization without;
		if (ways.without) without = ways.without->localize(*question.scan);
		counts.localized_without += without.status == Status::kLocalized ? 1 : 0;
		if (!tables) continue;
		write_row(tables[0], question, result, ways.map);
		write_row(tables[1], question, known, "");
		write_row(tables[2], question, without, "");
	}
	return counts;
}

int run_sites(int argc, char** argv)
{
	const Atlas atlas = load_atlas(argv[2]);
	const std::filesystem::path folder = argv[3];
	const auto step = std::stoul(argv[4]);
	std::filesystem::create_directories(folder);
	print_heading();
	Counts all;
	for (int i = 5; i < argc; i++)
	{
		const std::string set = argv[i];
		const auto equals = set.find('='), comma = set.find(',', equals);
		if (equals == std::string::npos || comma == std::string::npos)
			throw std::runtime_error(set + " is not MAP=SCANS.rawlog,TRUTH.txt");
		const std::string map = set.substr(0, equals), rawlog = set.substr(equals + 1, comma - equals - 1);
		const auto run = load_run(rawlog, set.substr(comma + 1));
		std::vector<Question> questions;
		for (std::size_t frame = 0; frame < run.size(); frame += step)
			questions.push_back({run[frame].scan, run[frame].truth});
		const std::string name = map + "_" + std::filesystem::path(rawlog).stem().string();
		std::ofstream tables[3];
		for (std::size_t way = 0; way < 3; way++)
		{
			tables[way].open(
			    folder / (name + "_" + std::vector<std::string>{"atlas", "known", "without"}[way] + ".csv"));
			tables[way] << "timestamp,status,x,y,phi,confidence,total_ms,map\n";
		}
		const Counts counts = ask(Ways(atlas, map), questions, tables);
		print(name, counts);
		all += counts;
	}
	print("all", all);
	return EXIT_SUCCESS;
}

/// Takes 5 % of the walls of a floor away, or puts new ones into its rooms, in pieces of 1.5 m.
Grid altered(const Grid& floor, unsigned seed)
{
	Grid other = floor;
	std::mt19937 random(seed);
	const auto walls = static_cast<double>(std::count(floor.cells.begin(), floor.cells.end(), Cell::kOccupied));
	const int length = static_cast<int>(std::lround(1.5 / floor.cell_size));
	const auto below = [&](int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); };
	for (double changed = 0; changed < 0.05 * walls;)
	{
		const int x = below(floor.width), y = below(floor.height);
		const Cell from = random() % 2 == 0 ? Cell::kOccupied : Cell::kFree;
		if (floor.at(x, y) != from) continue;
		const bool is_upright = random() % 2 == 0;
		const int width = is_upright ? 3 : length, height = is_upright ? length : 3;
		for (int v = y; v < std::min(floor.height, y + height); v++)
			for (int u = x; u < std::min(floor.width, x + width); u++)
			{
				if (floor.at(u, v) != from) continue;
				other.cells[static_cast<std::size_t>(floor.index(u, v))] =
				    from == Cell::kOccupied ? Cell::kFree : Cell::kOccupied;
				changed += 1;
			}
	}
	return other;
}

mrpt::maps::COccupancyGridMap2D::Ptr map_of(const Grid& grid)
{
	std::vector<float> p_occupied;
	for (const Cell cell : grid.cells)
		p_occupied.push_back(cell == Cell::kFree ? 0.01F : cell == Cell::kOccupied ? 0.99F : NAN);
	return map_of_cells(
	    p_occupied, static_cast<std::size_t>(grid.width), {grid.cell_size, grid.origin_x, grid.origin_y});
}

/// Returns whether there is nothing within 0.3 m of a cell.
bool is_open(const Grid& grid, int column, int row)
{
	for (int y = row - 6; y <= row + 6; y++)
		for (int x = column - 6; x <= column + 6; x++)
			if (!grid.contains(x, y) || grid.at(x, y) != Cell::kFree) return false;
	return true;
}

/// Returns a scan by the exact rays of a floor.
mrpt::obs::CObservation2DRangeScan::Ptr scan_of(
    const RayCaster& caster, const mrpt::math::TPose2D& pose, double field_of_view, std::mt19937& random)
{
	std::normal_distribution<double> noise(0, 0.01);  // [m]
	auto scan = mrpt::obs::CObservation2DRangeScan::Create();
	const auto beams = static_cast<std::size_t>(field_of_view);
	scan->aperture = static_cast<float>((field_of_view - 1) * M_PI / 180);
	scan->rightToLeft = true;
	scan->maxRange = 30;
	scan->resizeScan(beams);
	for (std::size_t i = 0; i < beams; i++)
	{
		const double angle = pose.phi + (static_cast<double>(i) - 0.5 * (field_of_view - 1)) * M_PI / 180;
		const auto range = caster.cast(pose.x, pose.y, angle);
		scan->setScanRange(i, static_cast<float>(range + noise(random)));
		scan->setScanRangeValidity(i, range < 30);
	}
	return scan;
}

/// A scan of a floor somewhere in its open space.
Question question_on(const Grid& grid, double field_of_view, std::mt19937& random)
{
	std::uniform_real_distribution<double> unit(0, 1);
	mrpt::math::TPose2D pose;
	for (bool is_free = false; !is_free;)
	{
		pose = {
		    grid.origin_x + unit(random) * grid.width * grid.cell_size,
		    grid.origin_y + unit(random) * grid.height * grid.cell_size, M_PI * (2 * unit(random) - 1)};
		is_free = is_open(
		    grid, static_cast<int>((pose.x - grid.origin_x) / grid.cell_size),
		    static_cast<int>((pose.y - grid.origin_y) / grid.cell_size));
	}
	return {scan_of(RayCaster(grid, 30, false), pose, field_of_view, random), pose};
}

int run_floors(char** argv)
{
	const int floors = std::stoi(argv[2]), twins = std::stoi(argv[3]), queries = std::stoi(argv[4]);
	const double area = std::stod(argv[5]), field_of_view = std::stod(argv[6]);
	std::vector<AtlasMap> maps;
	std::vector<Grid> grids;
	for (int i = 0; i < floors; i++)
	{
		const auto base = static_cast<unsigned>(i / (twins + 1));
		Grid grid = benchmark::make_office_floor(area, 0.05, base + 1);
		if (i % (twins + 1) > 0) grid = altered(grid, static_cast<unsigned>(i));
		maps.push_back({std::to_string(i), std::make_shared<const Localizer>(map_of(grid))});
		grids.push_back(std::move(grid));
	}
	const Atlas atlas(std::move(maps));
	print_heading();
	std::mt19937 random(1);
	Counts all;
	for (int i = 0; i < queries; i++)
	{
		const int floor = static_cast<int>(random() % static_cast<unsigned>(floors));
		const auto question = question_on(grids[static_cast<std::size_t>(floor)], field_of_view, random);
		all += ask(Ways(atlas, std::to_string(floor)), {question}, nullptr);
	}
	print(mrpt::format("%d floors, %d alike, %.0f deg", floors, twins + 1, field_of_view), all);
	return EXIT_SUCCESS;
}
constexpr std::size_t kFramesOnFloor = 15;  //!< [-] of a drive

/// Returns the cells from which an open cell is reached by the shortest way through open cells, and how far that is.
std::vector<int> ways_from(const Grid& grid, int start)
{
	std::vector<int> way(grid.cells.size(), -1);
	std::deque<int> next = {start};
	way[static_cast<std::size_t>(start)] = 0;
	while (!next.empty())
	{
		const int cell = next.front();
		next.pop_front();
		for (const int step : {1, -1, grid.width, -grid.width})
		{
			const int to = cell + step;
			int& there = way[static_cast<std::size_t>(to)];
			if (there >= 0 || !is_open(grid, to % grid.width, to / grid.width)) continue;
			there = way[static_cast<std::size_t>(cell)] + 1;
			next.push_back(to);
		}
	}
	return way;
}

/// Returns the poses of a drive from an elevator to a place that is open on the next floor, too: the next elevator.
/// \param cell of the elevator; receives that of the next one
/// \return no poses if the elevator does not lead far enough
std::vector<mrpt::math::TPose2D> drive_on(const Grid& grid, const Grid& above, int& cell, std::mt19937& random)
{
	constexpr int kStep = 7;  // [cells] between frames
	constexpr int kFrames = static_cast<int>(kFramesOnFloor);
	const std::vector<int> way = ways_from(grid, cell);
	std::vector<int> goals;
	for (std::size_t i = 0; i < way.size(); i++)
		if (const int to = static_cast<int>(i);
		    way[i] == (kFrames - 1) * kStep && is_open(above, to % above.width, to / above.width))
			goals.push_back(to);
	if (goals.empty()) return {};
	int at = goals[random() % goals.size()];
	const int goal = at;
	std::vector<int> cells = {at};
	while (at != cell)
	{
		for (const int step : {1, -1, grid.width, -grid.width})
			if (way[static_cast<std::size_t>(at + step)] == way[static_cast<std::size_t>(at)] - 1)
			{
				at += step;
				break;
			}
		cells.push_back(at);
	}
	std::reverse(cells.begin(), cells.end());
	cell = goal;
	std::vector<mrpt::math::TPose2D> poses;
	for (std::size_t i = 0; i < kFramesOnFloor; i++)
	{
		const auto centre = [&](std::size_t k)
		{
			const int c = cells[std::min(k, cells.size() - 1)];
			return mrpt::math::TPoint2D(
			    grid.origin_x + (c % grid.width + 0.5) * grid.cell_size,
			    grid.origin_y + (c / grid.width + 0.5) * grid.cell_size);
		};
		const auto here = centre(i * kStep), ahead = centre((i + 1) * kStep);
		const double phi = i + 1 < kFramesOnFloor ? std::atan2(ahead.y - here.y, ahead.x - here.x) : poses.back().phi;
		poses.push_back({here.x, here.y, phi});
	}
	return poses;
}

/// Counts how an answer follows the robot after elevators.
struct Followed
{
	int elevators = 0, within_five = 0, kept = 0;
	double frames = 0;  //!< [-] until the first right one, sum over those within five

	/// \param right whether each frame after an elevator is right
	void add(const std::vector<bool>& right)
	{
		const auto first = std::find(right.begin(), right.end(), true) - right.begin();
		elevators++;
		if (first >= 5) return;
		within_five++;
		frames += static_cast<double>(first) + 1;
		kept += std::all_of(right.begin() + 4, right.end(), [](bool one) { return one; }) ? 1 : 0;
	}
	void print(const char* name) const
	{
		std::printf(
		    "%-7s right and sure within 5 frames of %d of %d elevators, after %.2f in the mean; after %d of them it "
		    "is so in all later frames\n",
		    name, within_five, elevators, frames / std::max(1, within_five), kept);
	}
};

bool is_near(const mrpt::math::TPose2D& pose, const mrpt::math::TPose2D& truth)
{
	return std::hypot(pose.x - truth.x, pose.y - truth.y) < 0.5 &&
	       std::abs(mrpt::math::wrapToPi(pose.phi - truth.phi)) < 10 * M_PI / 180;
}

/// Three floors; each of the others differs from the first in 5 % of its walls if `twins`.
std::vector<Grid> floors_of_building(double area, bool twins, unsigned seed)
{
	std::vector<Grid> grids;
	for (unsigned i = 0; i < 3; i++)
		grids.push_back(
		    twins && i > 0 ? altered(grids.front(), 10 * seed + i)
		                   : benchmark::make_office_floor(area, 0.05, 10 * seed + i));
	return grids;
}

/// Returns the poses of a drive, floor by floor.
std::vector<std::vector<mrpt::math::TPose2D>> planned(const std::vector<Grid>& grids, std::mt19937& random)
{
	for (;;)
	{
		std::vector<std::vector<mrpt::math::TPose2D>> drive;
		auto cell = static_cast<int>(random() % static_cast<unsigned>(grids[0].cells.size()));
		if (!is_open(grids[0], cell % grids[0].width, cell / grids[0].width)) continue;
		for (std::size_t floor = 0; floor < grids.size(); floor++)
		{
			drive.push_back(drive_on(grids[floor], grids[(floor + 1) % grids.size()], cell, random));
			if (drive.back().empty()) break;
		}
		if (!drive.back().empty()) return drive;
	}
}

/// Drives through three floors, and counts for the filter and the window.
void drive_through(
    const std::vector<Grid>& grids, double field_of_view, std::mt19937& random, Followed& fused, Followed& windowed)
{
	std::vector<AtlasMap> maps;
	std::vector<FusionMap> fusion_maps;
	for (const Grid& grid : grids)
	{
		const auto map = CSignatureMap2D::Create(*map_of(grid));
		const std::string name = std::to_string(maps.size());
		maps.push_back({name, {map, &map->localizer()}});
		fusion_maps.push_back({map, {}, name});
	}
	const Atlas atlas(std::move(maps));
	CParticleFilterFusion filter;
	filter.start(fusion_maps, {});
	WindowLocalizer window(atlas, 10);
	const auto drive = planned(grids, random);
	std::optional<mrpt::math::TPose2D> last;
	for (std::size_t floor = 0; floor < grids.size(); floor++)
	{
		const RayCaster caster(grids[floor], 30, false);
		std::vector<bool> fused_right, window_right;
		for (const auto& pose : drive[floor])
		{
			// A robot that leaves the elevator turns to where it goes; the wheels measure that, too.
			auto motion = last ? mrpt::poses::CPose2D(pose) - mrpt::poses::CPose2D(*last) : mrpt::poses::CPose2D();
			motion = {1.03 * motion.x(), 1.03 * motion.y(), 1.03 * motion.phi()};
			const auto scan = scan_of(caster, pose, field_of_view, random);
			const Localization alone = atlas.localize(*scan);
			const auto followed = filter.step({*scan, alone, last ? std::optional(motion) : std::nullopt});
			const Localization result = window.add(
			    make_scan(*scan, atlas.maps().front().localizer->parameters().scan), alone,
			    last ? std::optional(motion) : std::nullopt);
			const std::string name = std::to_string(floor);
			fused_right.push_back(
			    followed && followed->status == FusionStatus::kTracking && followed->map == name &&
			    is_near(followed->pose, pose));
			window_right.push_back(
			    result.status == Status::kLocalized && result.best().map == name &&
			    is_near(result.best().pose.asTPose(), pose));
			last = pose;
		}
		if (floor == 0) continue;
		fused.add(fused_right);
		windowed.add(window_right);
	}
}

int run_elevators(char** argv)
{
	const int drives = std::stoi(argv[2]);
	const double area = std::stod(argv[3]), field_of_view = std::stod(argv[4]);
	const bool twins = std::stoi(argv[5]) > 0;
	std::mt19937 random(1);
	Followed fused, windowed;
	for (int drive = 0; drive < drives; drive++)
		drive_through(
		    floors_of_building(area, twins, static_cast<unsigned>(drive + 1)), field_of_view, random, fused, windowed);
	fused.print("filter");
	windowed.print("window");
	return EXIT_SUCCESS;
}
}  // namespace

int main(int argc, char** argv)
try
{
	const std::string what = argc > 1 ? argv[1] : "";
	if (what == "sites" && argc > 5) return run_sites(argc, argv);
	if (what == "floors" && argc == 7) return run_floors(argv);
	if (what == "elevators" && argc == 6) return run_elevators(argv);
	std::fprintf(stderr, "usage: see the head of atlas_experiment.cpp\n");
	return EXIT_FAILURE;
}
catch (const std::exception& error)
{
	std::fprintf(stderr, "atlas_experiment: %s\n", error.what());
	return EXIT_FAILURE;
}
