// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// make_sites COLLECTION OUT_FOLDER [SITE...]
// Makes the folders of sites that the experiments read (see sites.py) from a clone of a public collection: GitHub's
// acschaefer/ple, whose folder data/carmen holds logs of the Radish repository that a SLAM program has corrected.
// A site gets
//   map.png, map.yaml            drawn from all scans of the log at their corrected poses
//   map_test.png, map_test.yaml  drawn from the first half of them (fr_campus: from every second one)
//   test.rawlog, test_gt.txt     scans that map_test has never seen, one per 0.25 m or 15 deg, and their true poses
//   run.rawlog, run_gt.txt       all scans in order, with the odometry of the wheels
//   info.txt                     what was left out, and how far poses moved when they were checked
// A line of truth is `time x y phi`: s, m, m, rad, robot in map. A test scan is kept if map_test can explain half of
// its beams at the corrected pose, and if the pose moves by less than 0.15 m and 3 deg when it settles on map_test:
// where the correction is bad, or the place is not in the map, there is no truth.
#include <d2s1r/localizer.h>
#include <d2s1r/map_io.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/serialization/CArchive.h>
#include <zlib.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "map_files.h"

namespace
{
using mrpt::obs::CObservation2DRangeScan;
using mrpt::poses::CPose2D;

/// Says how a log of the collection becomes a site.
struct Recipe
{
	const char* site;
	const char* log;          //!< without "-corrected.log.gz"
	double degrees_per_beam;  //!< [deg]
	double cell_size;         //!< [m]
	double reach;             //!< [m] of the laser, beyond which a range is no return
	bool by_turns;            //!< whether map_test is drawn from every second scan instead of the first half
};

constexpr Recipe kRecipes[] = {
    {"intel", "intel", 1, 0.05, 80, false},
    {"fr079", "freiburg-079", 0.5, 0.05, 80, false},
    {"mit_csail", "csail", 0.5, 0.05, 80, false},
    {"mit_killian", "infinite-corridor", 1, 0.05, 80, false},
    {"fr_campus", "freiburg-campus", 0.5, 0.1, 80, true},
    {"acapulco", "acapulco", 1, 0.05, 80, false},
    {"aces", "aces", 1, 0.05, 80, false},
    {"belgioioso", "belgioioso", 0.5, 0.05, 80, false},
    {"edmonton", "edmonton", 1, 0.05, 80, false},
    {"fhw", "fhw", 1, 0.05, 80, false},
    {"fr101", "freiburg-101", 0.5, 0.05, 80, false},
    {"orebro", "orebro", 1, 0.05, 80, true},
    {"seattle", "seattle", 0.5, 0.05, 80, true}};

/// Holds a scan of a log and where it was taken.
struct Keyframe
{
	CObservation2DRangeScan::Ptr scan;
	CPose2D robot;                    //!< in map, m and rad, as corrected
	std::optional<CPose2D> odometry;  //!< of the wheels, in their frame
};

/// Returns the lines of a text file that may be packed by gzip.
std::vector<std::string> lines_of(const std::string& file)
{
	const std::unique_ptr<gzFile_s, int (*)(gzFile)> stream(gzopen(file.c_str(), "rb"), gzclose);
	if (!stream) throw std::runtime_error(file + ": cannot be read; give the folder of a clone of acschaefer/ple");
	std::vector<std::string> lines(1);
	for (int c = gzgetc(stream.get()); c >= 0; c = gzgetc(stream.get()))
		if (c == '\n')
			lines.emplace_back();
		else
			lines.back() += static_cast<char>(c);
	return lines;
}

/// Reads the numbers of a line FLASER into a keyframe. Beams go from right to left; where they fill 180 deg with a gap
/// of one beam at the end, the laser looks half a beam to the right.
/// \throws std::runtime_error if the line is not of that form
Keyframe read_scan(std::istringstream& words, const Recipe& recipe, double time)
{
	Keyframe frame;
	std::size_t beams = 0;
	words >> beams;
	if (!words || beams < 90 || beams > 1081) throw std::runtime_error("has no plausible number of beams");
	frame.scan = CObservation2DRangeScan::Create();
	CObservation2DRangeScan& scan = *frame.scan;
	scan.sensorLabel = "FLASER";
	scan.timestamp = mrpt::Clock::fromDouble(time);
	scan.maxRange = static_cast<float>(recipe.reach);
	const double aperture = mrpt::DEG2RAD(recipe.degrees_per_beam * static_cast<double>(beams - 1));
	scan.aperture = static_cast<float>(aperture);
	scan.sensorPose = mrpt::poses::CPose3D(0, 0, 0, -mrpt::DEG2RAD(90.0) + aperture / 2, 0, 0);
	scan.resizeScan(beams);
	for (std::size_t i = 0; i < beams; i++)
	{
		double range = 0;
		words >> range;
		const bool is_return = range > 0 && range < recipe.reach;
		scan.setScanRange(i, static_cast<float>(is_return ? range : recipe.reach));
		scan.setScanRangeValidity(i, is_return);
	}
	double x = 0, y = 0, phi = 0;
	words >> x >> y >> phi;
	if (!words) throw std::runtime_error("is too short");
	frame.robot = CPose2D(x, y, phi);
	return frame;
}

/// Reads the scans of a corrected log. Its clocks jump; scans get times of their own, in their order.
std::vector<Keyframe> read_log(const std::string& file, const Recipe& recipe)
{
	constexpr double kStart = 1e9, kStep = 0.2;  // [s]
	std::vector<Keyframe> frames;
	std::optional<CPose2D> odometry;
	std::size_t number = 0;
	for (const std::string& line : lines_of(file)) try
		{
			number++;
			std::istringstream words(line);
			std::string kind;
			words >> kind;
			double x = 0, y = 0, phi = 0;
			if (kind == "ODOM" && words >> x >> y >> phi) odometry = CPose2D(x, y, phi);
			if (kind != "FLASER") continue;
			frames.push_back(read_scan(words, recipe, kStart + kStep * static_cast<double>(frames.size())));
			frames.back().odometry = odometry;
		}
		catch (const std::exception& error)
		{
			throw std::runtime_error(file + ":" + std::to_string(number) + ": " + error.what());
		}
	if (frames.empty()) throw std::runtime_error(file + ": holds no line FLASER");
	return frames;
}

mrpt::maps::COccupancyGridMap2D::Ptr draw_map(const std::vector<Keyframe>& frames, double cell_size)
{
	constexpr float kReach = 40;  // [m] further away, beams are too far apart to draw walls
	auto map = mrpt::maps::COccupancyGridMap2D::Create(-1.0F, 1.0F, -1.0F, 1.0F, static_cast<float>(cell_size));
	map->insertionOptions.maxDistanceInsertion = kReach;
	map->insertionOptions.considerInvalidRangesAsFreeSpace = false;
	map->insertionOptions.maxOccupancyUpdateCertainty = 0.75F;
	map->insertionOptions.maxFreenessUpdateCertainty = 0.58F;
	for (const Keyframe& frame : frames)
	{
		const mrpt::poses::CPose3D robot(frame.robot);
		map->insertObservation(*frame.scan, robot);
	}
	return map;
}

/// Counts the scans that are no test scans, by why.
struct LeftOut
{
	int by_nearness = 0, by_map = 0, by_motion = 0;  //!< [-]
};

/// Returns those of `frames` that map_test has a truth for, one per 0.25 m or 15 deg.
std::vector<Keyframe> test_scans(const std::vector<Keyframe>& frames, const d2s1r::Localizer& localizer, LeftOut& out)
{
	constexpr double kWay = 0.25, kLeastExplained = 0.5, kMostMoved = 0.15;  // [m], [0, 1], [m]
	const double turn = mrpt::DEG2RAD(15.0), most_turned = mrpt::DEG2RAD(3.0);
	std::vector<Keyframe> kept;
	std::optional<CPose2D> last;
	for (const Keyframe& frame : frames)
	{
		const CPose2D moved = last ? frame.robot - *last : CPose2D(HUGE_VAL, 0, 0);
		if (moved.norm() < kWay && std::abs(mrpt::math::wrapToPi(moved.phi())) < turn)
		{
			out.by_nearness++;
			continue;
		}
		last = frame.robot;
		const auto scan = make_scan(*frame.scan, localizer.parameters().scan);
		const auto settled = localizer.hypothesis_near(scan, frame.robot);
		if (!settled || settled->explained < kLeastExplained)
		{
			out.by_map++;
			continue;
		}
		const CPose2D off = settled->pose - frame.robot;
		if (off.norm() > kMostMoved || std::abs(mrpt::math::wrapToPi(off.phi())) > most_turned)
		{
			out.by_motion++;
			continue;
		}
		kept.push_back(frame);
	}
	return kept;
}

/// Writes NAME.rawlog and NAME_gt.txt.
void save_scans(const std::vector<Keyframe>& frames, bool with_odometry, const std::string& name)
{
	mrpt::io::CFileGZOutputStream stream;
	if (!stream.open(name + ".rawlog")) throw std::runtime_error(name + ".rawlog: cannot be written");
	auto archive = mrpt::serialization::archiveFrom(stream);
	std::ofstream truth(name + "_gt.txt");
	truth << "% time x y phi  (robot pose in the map frame, s, m, rad)\n";
	for (const Keyframe& frame : frames)
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
std::pair<std::vector<Keyframe>, std::vector<Keyframe>> split(const std::vector<Keyframe>& frames, bool by_turns)
{
	std::vector<Keyframe> drawn, others;
	for (std::size_t i = 0; i < frames.size(); i++)
		(by_turns ? i % 2 == 0 : i < frames.size() / 2) ? drawn.push_back(frames[i]) : others.push_back(frames[i]);
	return {drawn, others};
}

void make_site(const Recipe& recipe, const std::string& collection, const std::string& out)
{
	const std::string folder = out + "/" + recipe.site;
	std::filesystem::create_directories(folder);
	const auto frames = read_log(collection + "/data/carmen/" + recipe.log + "-corrected.log.gz", recipe);
	const auto [drawn, others] = split(frames, recipe.by_turns);
	d2s1r::experiments::save_map(*draw_map(frames, recipe.cell_size), folder + "/map");
	d2s1r::experiments::save_map(*draw_map(drawn, recipe.cell_size), folder + "/map_test");
	save_scans(frames, true, folder + "/run");
	LeftOut left_out;
	const d2s1r::Localizer localizer(d2s1r::load_map(folder + "/map_test.yaml"));
	const auto tests = test_scans(others, localizer, left_out);
	save_scans(tests, false, folder + "/test");
	std::ofstream info(folder + "/info.txt");
	info << "made by make_sites from " << recipe.log << "-corrected.log.gz of acschaefer/ple\n"
	     << frames.size() << " scans; " << drawn.size() << " draw map_test; of the others " << tests.size()
	     << " are test scans, " << left_out.by_nearness << " are too near to the one before, " << left_out.by_map
	     << " are not half explained by map_test, " << left_out.by_motion
	     << " move by 0.15 m or 3 deg when they settle\n";
	std::printf("%-12s %4zu scans, %4zu of them test scans\n", recipe.site, frames.size(), tests.size());
	std::fflush(stdout);
}
}  // namespace

int main(int count, char** words)
try
{
	if (count < 3) throw std::runtime_error("usage: make_sites COLLECTION OUT_FOLDER [SITE...]");
	const std::vector<std::string> asked(words + 3, words + count);
	std::size_t made = 0;
	for (const Recipe& recipe : kRecipes)
	{
		if (!asked.empty() && std::find(asked.begin(), asked.end(), recipe.site) == asked.end()) continue;
		make_site(recipe, words[1], words[2]);
		made++;
	}
	if (made < asked.size())
		throw std::runtime_error("one of the sites is unknown; the list is kRecipes in make_sites.cpp");
}
catch (const std::exception& error)
{
	std::fprintf(stderr, "make_sites: %s\n", error.what());
	return 1;
}
