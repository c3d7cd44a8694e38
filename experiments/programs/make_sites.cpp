// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// make_sites CORRECTED RAW OUT_FOLDER [SITE...]
// Makes the folders of sites that the experiments read (see sites.py) from clones of two public collections.
//   CORRECTED  GitHub's acschaefer/ple: its folder data/carmen holds logs of the Radish repository that a SLAM program
//              has corrected, with a scan about each metre
//   RAW        GitHub's MOLAorg/mola_test_datasets: its folder datasets/radish holds all scans of four of these drives
// A site gets
//   map.png, map.yaml            drawn from all scans of the corrected log
//   map_test.png, map_test.yaml  drawn from the first half of them (by_turns: from every second one)
//   test.rawlog, test_gt.txt     all scans that map_test has never seen, one per 0.25 m or 15 deg, and their true poses
//   test_scans.csv               what is known of each of them: see below
//   run.rawlog, run_gt.txt       all scans of the corrected log in order, with the odometry of the wheels
//   sim360_on, sim360_off, sim360_clutter, sim270_off (.rawlog, _gt.txt)   scans simulated in map, indoors only
//   info.txt                     how many scans there are of each kind
// A line of truth is `time x y phi`: s, m, m, rad, robot in map. Corrected poses are some 3 cm and 0.2 deg off, which
// doubles walls; settle() makes them fit together. Test scans settle on the whole map where they fit it near their
// pose; elsewhere the log's own pose is the truth. Columns of test_scans.csv:
//   timestamp  [s]
//   on_walls   [0, 1] of the returns that end within 0.1 m of walls of map_test, at the truth: from a half on the place
//              is in the map
//   doubtful   1 if the log contradicts the truth: see TruthCheck. No map has a say in that.
#include <d2s1r/localizer.h>
#include <d2s1r/mrpt.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "map_files.h"
#include "recorded_drive.h"
#include "simulated_sets.h"
#include "truth_check.h"

namespace
{
using d2s1r::Localizer;
using mrpt::poses::CPose2D;
using namespace d2s1r::experiments;

/// Says how logs become a site.
struct Recipe
{
	const char* site;
	const char* corrected;  //!< without "-corrected.log.gz"
	const char* raw;        //!< without ".rawlog"; empty: the test scans are those of the corrected log
	Beams beams;
	double cell_size;    //!< [m]
	double drawn_reach;  //!< [m] of the beams that draw the map
	bool by_turns;       //!< whether map_test is drawn from every second scan instead of the first half
	bool is_indoors;
};

constexpr Recipe kRecipes[] = {
    {"intel", "intel", "intel", {1, 80}, 0.05, 20, false, true},
    {"fr079", "freiburg-079", "", {0.5, 80}, 0.05, 20, false, true},
    {"mit_csail", "csail", "mit-csail", {0.5, 80}, 0.05, 20, false, true},
    {"mit_killian", "infinite-corridor", "mit-killian", {1, 50}, 0.05, 20, false, true},
    {"fr_campus", "freiburg-campus", "", {0.5, 80}, 0.1, 50, true, false},
    {"acapulco", "acapulco", "", {1, 80}, 0.05, 20, false, true},
    {"aces", "aces", "", {1, 80}, 0.05, 20, false, true},
    {"belgioioso", "belgioioso", "", {0.5, 80}, 0.05, 20, false, true},
    {"edmonton", "edmonton", "", {1, 80}, 0.05, 20, false, true},
    {"fhw", "fhw", "", {1, 80}, 0.05, 20, false, true},
    {"fr101", "freiburg-101", "", {0.5, 80}, 0.05, 20, false, true},
    {"orebro", "orebro", "", {1, 80}, 0.05, 20, true, true},
    {"seattle", "seattle", "", {0.5, 80}, 0.05, 20, true, true}};

constexpr double kInMap = 0.5;  //!< [0, 1] of the returns on walls from which a place is in the map

std::vector<PlacedScan> placed(const std::vector<DrivenScan>& scans)
{
	return {scans.begin(), scans.end()};
}

/// Returns where the scan fits best near its pose; no value if it fits badly there, or only far away.
std::optional<CPose2D> settled(const PlacedScan& placed, const Localizer& localizer)
{
	constexpr double kLeastExplained = 0.3, kMostMoved = 0.2;  // [0, 1], [m]
	const double most_turned = mrpt::DEG2RAD(4.0);
	const auto fit =
	    localizer.hypothesis_near(make_scan(d2s1r::scan_of(*placed.scan), localizer.parameters().scan), placed.robot);
	if (!fit || fit->explained < kLeastExplained) return std::nullopt;
	const CPose2D moved = fit->pose - placed.robot;
	if (moved.norm() > kMostMoved || std::abs(mrpt::math::wrapToPi(moved.phi())) > most_turned) return std::nullopt;
	return fit->pose;
}

/// Moves the scans to where they fit each other: even ones on the map that odd ones draw, odd ones on that of the even
/// ones, and so on. A scan that fits nowhere near stays.
void settle(std::vector<DrivenScan>& scans, const Recipe& recipe)
{
	constexpr std::size_t kTurns = 8;
	for (std::size_t turn = 0; turn < kTurns; turn++)
	{
		std::vector<PlacedScan> others;
		for (std::size_t i = 1 - turn % 2; i < scans.size(); i += 2) others.push_back(scans[i]);
		const Localizer localizer(d2s1r::grid_of(*count_map(others, recipe.cell_size, recipe.drawn_reach)));
		for (std::size_t i = turn % 2; i < scans.size(); i += 2)
			scans[i].robot = settled(scans[i], localizer).value_or(scans[i].robot);
	}
}

/// Returns the share of the returns of a scan that end within 0.1 m of an occupied cell.
double share_on_walls(const PlacedScan& placed, const mrpt::maps::COccupancyGridMap2D& map)
{
	constexpr float kNear = 0.1F;  // [m]
	mrpt::maps::CSimplePointsMap points;
	points.insertionOptions.minDistBetweenLaserPoints = 0;
	points.insertionOptions.also_interpolate = false;
	points.insertObservation(*placed.scan, mrpt::poses::CPose3D(placed.robot));
	std::size_t on_walls = 0;
	for (std::size_t i = 0; i < points.size(); i++)
	{
		float x = 0, y = 0;
		points.getPoint(i, x, y);
		const float cell = map.getResolution();
		const int reach = static_cast<int>(std::ceil(kNear / cell)), cx = map.x2idx(x), cy = map.y2idx(y);
		bool is_near = false;
		for (int dy = -reach; dy <= reach; dy++)
			for (int dx = -reach; dx <= reach; dx++)
				is_near |= std::hypot(dx, dy) * cell <= kNear + 1e-4F && map.getCell(cx + dx, cy + dy) < 0.4F;
		on_walls += is_near ? 1 : 0;
	}
	return points.empty() ? 0 : static_cast<double>(on_walls) / static_cast<double>(points.size());
}

/// Holds a scan that map_test has not seen, at its truth.
struct TestScan : DrivenScan
{
	double on_walls = 0;  //!< [0, 1] of its returns that end at walls of map_test
	bool is_doubtful = false;
};

/// Returns one of `scans` per 0.25 m or 15 deg, settled on the whole map where they fit it.
std::vector<TestScan> test_scans(
    const std::vector<DrivenScan>& scans, const Localizer& whole, const mrpt::maps::COccupancyGridMap2D& map_test)
{
	constexpr double kWay = 0.25;  // [m]
	const double turn = mrpt::DEG2RAD(15.0);
	std::vector<DrivenScan> settled_scans = scans;
	for (DrivenScan& scan : settled_scans) scan.robot = settled(scan, whole).value_or(scan.robot);
	const TruthCheck check(settled_scans);
	std::vector<TestScan> kept;
	std::optional<CPose2D> last;
	for (std::size_t i = 0; i < scans.size(); i++)
	{
		const CPose2D moved = last ? scans[i].robot - *last : CPose2D(HUGE_VAL, 0, 0);
		if (moved.norm() < kWay && std::abs(mrpt::math::wrapToPi(moved.phi())) < turn) continue;
		last = scans[i].robot;
		kept.push_back({settled_scans[i], share_on_walls(settled_scans[i], map_test), check.is_doubtful(i)});
	}
	return kept;
}

/// Writes what is known of each test scan.
void save_knowledge(const std::vector<TestScan>& scans, const std::string& file)
{
	std::ofstream stream(file);
	stream << "timestamp,on_walls,doubtful\n";
	for (const TestScan& scan : scans)
	{
		char line[60];
		std::snprintf(
		    line, sizeof line, "%.6f,%.3f,%d\n", mrpt::Clock::toDouble(scan.scan->timestamp), scan.on_walls,
		    scan.is_doubtful ? 1 : 0);
		stream << line;
	}
	if (!stream.flush()) throw std::runtime_error(file + ": cannot be written");
}

/// Writes NAME.rawlog and NAME_gt.txt.
void save_scans(const std::vector<DrivenScan>& frames, bool with_odometry, const std::string& name)
{
	mrpt::io::CFileGZOutputStream stream;
	if (!stream.open(name + ".rawlog")) throw std::runtime_error(name + ".rawlog: cannot be written");
	auto archive = mrpt::serialization::archiveFrom(stream);
	std::ofstream truth(name + "_gt.txt");
	truth << "% time x y phi  (robot pose in the map frame, s, m, rad)\n";
	for (const DrivenScan& frame : frames)
	{
		if (with_odometry && frame.odometry)
		{
			mrpt::obs::CObservationOdometry odometry;
			odometry.sensorLabel = "ODOMETRY";
			odometry.timestamp = frame.scan->timestamp;
			odometry.odometry = *frame.odometry;
			archive << odometry;
		}
		archive << *frame.scan;
		char line[100];
		std::snprintf(
		    line, sizeof line, "%.6f %.4f %.4f %.6f\n", mrpt::Clock::toDouble(frame.scan->timestamp), frame.robot.x(),
		    frame.robot.y(), frame.robot.phi());
		truth << line;
	}
	if (!truth.flush()) throw std::runtime_error(name + "_gt.txt: cannot be written");
}

/// Splits the log into the scans that draw map_test and the others.
std::pair<std::vector<DrivenScan>, std::vector<DrivenScan>> split(const std::vector<DrivenScan>& scans, bool by_turns)
{
	std::vector<DrivenScan> drawn, others;
	for (std::size_t i = 0; i < scans.size(); i++)
		(by_turns ? i % 2 == 0 : i < scans.size() / 2) ? drawn.push_back(scans[i]) : others.push_back(scans[i]);
	return {drawn, others};
}

void make_site(const Recipe& recipe, const std::string& corrected, const std::string& raw, const std::string& out)
{
	const std::string folder = out + "/" + recipe.site;
	std::filesystem::create_directories(folder);
	auto scans = read_corrected_log(corrected + "/data/carmen/" + recipe.corrected + "-corrected.log.gz", recipe.beams);
	settle(scans, recipe);
	save_scans(scans, true, folder + "/run");
	const auto [drawn, others] = split(scans, recipe.by_turns);
	const bool has_raw = *recipe.raw != '\0';
	const auto unseen =
	    has_raw ? read_raw_log(raw + "/datasets/radish/" + recipe.raw + ".rawlog", recipe.beams, others) : others;
	const auto map = count_map(placed(scans), recipe.cell_size, recipe.drawn_reach);
	const auto map_test = count_map(placed(drawn), recipe.cell_size, recipe.drawn_reach);
	save_map(*map, folder + "/map");
	save_map(*map_test, folder + "/map_test");
	const auto tests = test_scans(unseen, Localizer(d2s1r::grid_of(*map)), *map_test);
	save_scans({tests.begin(), tests.end()}, false, folder + "/test");
	save_knowledge(tests, folder + "/test_scans.csv");
	if (recipe.is_indoors)
	{
		std::vector<CPose2D> driven;
		for (const DrivenScan& scan : scans) driven.push_back(scan.robot);
		for (const auto& [name, simulated] : simulated_sets(d2s1r::make_grid(*d2s1r::grid_of(*map), {}), driven))
			save_scans(simulated, false, folder + "/" + name);
	}
	std::ofstream info(folder + "/info.txt");
	info << "made by make_sites from " << recipe.corrected << "-corrected.log.gz of acschaefer/ple";
	if (has_raw) info << " and " << recipe.raw << ".rawlog of MOLAorg/mola_test_datasets";
	const auto count = [&](auto is_such) { return std::count_if(tests.begin(), tests.end(), is_such); };
	info << '\n'
	     << scans.size() << " scans; " << drawn.size() << " draw map_test; of " << unseen.size() << " others "
	     << tests.size() << " are test scans, the rest are too near to the one before; of the test scans "
	     << count([](const TestScan& scan) { return scan.on_walls >= kInMap; })
	     << " have half of their returns on walls of map_test, and the truth of "
	     << count([](const TestScan& scan) { return scan.is_doubtful; }) << " is doubtful by the log itself\n";
	std::printf("%-12s %4zu scans, %4zu test scans\n", recipe.site, scans.size(), tests.size());
	std::fflush(stdout);
}

/// Refuses a name that is not the name of a site. \throws std::runtime_error that lists the names
void check_sites(const std::vector<std::string>& asked)
{
	std::string names;
	for (const Recipe& recipe : kRecipes) names += (names.empty() ? "" : ", ") + std::string(recipe.site);
	for (const std::string& name : asked)
		if (std::none_of(std::begin(kRecipes), std::end(kRecipes), [&](const auto& one) { return name == one.site; }))
			throw std::runtime_error("'" + name + "' is not a site that can be made; choose from " + names);
}
}  // namespace

int main(int count, char** words)
try
{
	if (count < 4) throw std::runtime_error("usage: make_sites CORRECTED RAW OUT_FOLDER [SITE...]");
	const std::vector<std::string> asked(words + 4, words + count);
	check_sites(asked);
	for (const Recipe& recipe : kRecipes)
		if (asked.empty() || std::find(asked.begin(), asked.end(), recipe.site) != asked.end())
			make_site(recipe, words[1], words[2], words[3]);
}
catch (const std::exception& error)
{
	std::fprintf(stderr, "make_sites: %s\n", error.what());
	return 1;
}
