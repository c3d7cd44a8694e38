// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What compare.py gives to a driver of somebody else's program, and what it takes: DRIVER MAP.txt SCANS.txt OUT.csv
//   MAP.txt    file of a picture in the same folder (PGM: 0 occupied, 205 unknown, 254 free; rows from the top), side
//              of a cell [m], x and y of the lower left corner [m]
//   SCANS.txt  a line for each scan: time [s], angle of the first beam and step [rad], range that the laser sees up to
//              [m], pose of the laser on the robot [m, m, rad], ranges [m]: inf where nothing returned, nan: no data
//   OUT.csv    timestamp,status,x,y,phi,confidence,total_ms: pose of the robot in the map, processor time of the scan
// The driver prints {"preparation_s": S, "memory_mb": MB} at its end.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace peer
{
struct Map
{
	int width = 0, height = 0;        //!< [cell]
	double cell = 0, x = 0, y = 0;    //!< [m]
	std::vector<std::uint8_t> cells;  //!< rows from the bottom

	bool is_occupied(int column, int row) const { return at(column, row) == 0; }
	bool is_free(int column, int row) const { return at(column, row) == 254; }
	std::uint8_t at(int column, int row) const { return cells[static_cast<std::size_t>(row * width + column)]; }
};

struct Pose
{
	double x = 0, y = 0, phi = 0;  //!< [m, m, rad]
};

struct Scan
{
	double time = 0, first = 0, step = 0, max_range = 0;  //!< [s, rad, rad, m]
	Pose laser;                                           //!< on the robot
	std::vector<double> ranges;                           //!< [m]
};

struct Answer
{
	Pose robot;
	double confidence = 1;  //!< [0, 1]
	bool is_sure = true;
};

inline Map read_map(const std::string& file)
{
	std::ifstream text(file);
	std::string picture;
	Map map;
	if (!(text >> picture >> map.cell >> map.x >> map.y)) throw std::runtime_error(file + ": is no map");
	std::ifstream stream(std::filesystem::path(file).parent_path() / picture, std::ios::binary);
	std::string kind;
	int white = 0;
	stream >> kind >> map.width >> map.height >> white;
	stream.get();
	map.cells.resize(static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height));
	for (int row = map.height - 1; row >= 0; row--)
		stream.read(reinterpret_cast<char*>(&map.cells[static_cast<std::size_t>(row * map.width)]), map.width);
	if (!stream || kind != "P5") throw std::runtime_error(picture + ": is no PGM");
	return map;
}

inline std::vector<Scan> read_scans(const std::string& file)
{
	std::ifstream stream(file);
	std::vector<Scan> scans;
	for (std::string line; std::getline(stream, line);)
	{
		std::istringstream words(line);
		Scan scan;
		words >> scan.time >> scan.first >> scan.step >> scan.max_range >> scan.laser.x >> scan.laser.y >>
		    scan.laser.phi;
		for (std::string word; words >> word;) scan.ranges.push_back(std::strtod(word.c_str(), nullptr));
		scans.push_back(scan);
	}
	return scans;
}

inline double processor_time()
{
	return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// Runs a program on a map and on scans. `prepare` takes the map and returns what localizes a scan.
inline int main_of(
    int count, char** words,
    const std::function<std::function<std::optional<Answer>(const Scan&)>(const Map&)>& prepare)
try
{
	if (count != 4) throw std::runtime_error("usage: DRIVER MAP.txt SCANS.txt OUT.csv");
	const double start = processor_time();
	const auto localize = prepare(read_map(words[1]));
	const double preparation = processor_time() - start;
	std::FILE* out = std::fopen(words[3], "w");
	if (out == nullptr) throw std::runtime_error(std::string(words[3]) + ": cannot be written");
	std::fprintf(out, "timestamp,status,x,y,phi,confidence,total_ms\n");
	for (const Scan& scan : read_scans(words[2]))
	{
		const double before = processor_time();
		const auto answer = localize(scan);
		const double spent = 1e3 * (processor_time() - before);
		if (answer)
			std::fprintf(
			    out, "%.6f,%s,%.6f,%.6f,%.6f,%.4f,%.3f\n", scan.time, answer->is_sure ? "localized" : "ambiguous",
			    answer->robot.x, answer->robot.y, answer->robot.phi, answer->confidence, spent);
		else
			std::fprintf(out, "%.6f,rejected,,,,,%.3f\n", scan.time, spent);
	}
	std::fclose(out);
	std::ifstream status("/proc/self/status");
	double memory = 0;  // [kB]
	for (std::string word; status >> word;)
		if (word == "VmHWM:") status >> memory;
	std::printf("{\"preparation_s\": %.3f, \"memory_mb\": %.1f}\n", preparation, memory / 1024);
	return 0;
}
catch (const std::exception& error)
{
	std::fprintf(stderr, "%s: %s\n", words[0], error.what());
	return 1;
}
}  // namespace peer
