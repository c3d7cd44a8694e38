// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// atlas_experiment sites ATLAS.yaml OUT_DIR STEP MAP=SCANS.rawlog,TRUTH.txt...
//   Localizes every STEP-th scan of each set, whose true map is MAP, in three ways: in the atlas, in MAP alone, and in
//   the atlas without MAP.
// atlas_experiment floors FLOORS TWINS QUERIES AREA FIELD_OF_VIEW
//   The same on generated floors of AREA [m^2], full circles or parts of them [deg] with 1 cm of noise. TWINS of each
//   TWINS + 1 floors differ from the first of them in 5 % of their walls; all of them are taken out with the true map.
//   How many answers are not `localized` where another floor looks alike from there is counted, too.
//
// Both print a line for each set: how often the map is right, map and pose (0.3 m, 5 deg) are, how often they
// are when the map is known, the share of frames called localized and how many of these are right, the share called
// localized without the true map, and the time of a scan in the atlas. OUT_DIR receives a table for each set and way in
// the form of frames.csv; a pose in a wrong map is left out there.
#include <d2s1r/atlas.h>
#include <d2s1r/map_io.h>
#include <d2s1r/mrpt.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <stdexcept>

#include "made_floors.h"
#include "office_floor.h"
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
	Localization result = localizer.localize(scan_of(scan));
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

	/// \param taken_out maps that the atlas without the true one lacks
	Ways(const Atlas& the_atlas, const std::string& the_map, const std::set<std::string>& taken_out)
	    : atlas(the_atlas), known(*the_atlas.at(the_map).localizer), map(the_map)
	{
		std::vector<AtlasMap> others;
		for (const AtlasMap& one : atlas.maps())
			if (taken_out.count(one.name) == 0) others.push_back(one);
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
		if (ways.without) without = ways.without->localize(scan_of(*question.scan));
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
		const Counts counts = ask(Ways(atlas, map, {map}), questions, tables);
		print(name, counts);
		all += counts;
	}
	print("all", all);
	return EXIT_SUCCESS;
}

int run_floors(char** argv)
{
	const int floors = std::stoi(argv[2]), twins = std::stoi(argv[3]), queries = std::stoi(argv[4]);
	const double area = std::stod(argv[5]), field_of_view = std::stod(argv[6]);
	std::vector<AtlasMap> maps;
	std::vector<Grid> grids;
	const auto first_alike = [=](int i) { return i / (twins + 1) * (twins + 1); };
	for (int i = 0; i < floors; i++)
	{
		const auto base = static_cast<unsigned>(i / (twins + 1));
		Grid grid = benchmark::make_office_floor(area, 0.05, base + 1);
		if (i > first_alike(i)) grid = altered(grid, static_cast<unsigned>(i));
		maps.push_back({std::to_string(i), std::make_shared<const Localizer>(map_of(grid))});
		grids.push_back(std::move(grid));
	}
	const Atlas atlas(std::move(maps));
	print_heading();
	std::mt19937 random(1);
	Counts all;
	int alike = 0, wrong = 0;
	for (int i = 0; i < queries; i++)
	{
		const int floor = static_cast<int>(random() % static_cast<unsigned>(floors));
		const Grid& grid = grids[static_cast<std::size_t>(floor)];
		const auto pose = open_pose_on(grid, random);
		const Question question{scan_of(RayCaster(grid, 30), pose, field_of_view, random), pose};
		std::set<std::string> family;
		bool looks_alike = false;
		for (int j = first_alike(floor); j < std::min(floors, first_alike(floor) + twins + 1); j++)
		{
			family.insert(std::to_string(j));
			looks_alike = looks_alike ||
			              (j != floor && look_alike(grid, grids[static_cast<std::size_t>(j)], pose, field_of_view));
		}
		const Counts one = ask(Ways(atlas, std::to_string(floor), family), {question}, nullptr);
		alike += looks_alike && one.localized_right == 0 && one.localized == 0 ? 1 : 0;
		wrong += one.localized > one.localized_right ? 1 : 0;
		all += one;
	}
	print(mrpt::format("%d floors, %d alike, %.0f deg", floors, twins + 1, field_of_view), all);
	std::printf("not localized where another floor looks alike: %d; localized and wrong: %d\n", alike, wrong);
	return EXIT_SUCCESS;
}
}  // namespace

int main(int argc, char** argv)
try
{
	const std::string what = argc > 1 ? argv[1] : "";
	if (what == "sites" && argc > 5) return run_sites(argc, argv);
	if (what == "floors" && argc == 7) return run_floors(argv);
	std::fprintf(stderr, "usage: see the head of atlas_experiment.cpp\n");
	return EXIT_FAILURE;
}
catch (const std::exception& error)
{
	std::fprintf(stderr, "atlas_experiment: %s\n", error.what());
	return EXIT_FAILURE;
}
