// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// rivals METHOD MAP QUERIES.rawlog OUT.csv [NAME=VALUE ...]
// Localizes each scan of a rawlog of observations with another method, or with this library, on one thread; OUT.csv has
// the columns of frames.csv, with processor times. Prints the time to prepare [s] and the peak of memory [MB] as JSON.
// METHOD  exhaustive | branch-and-bound | bag-of-words | phrases | glare | filter: each scan alone
//         literal: the published method as plain loops, for full circles of 360 beams, with the map and the scans read
//                  as the ini file of `config` says
//         d2s1r: the library, with the ini file of `config`
//         drives: the filter along parts of a rawlog with odometry, each of 40 frames; OUT.csv has a column `drive`
//   keyframes=RAWLOG truth=FILE  of the drive that built the map, with its ground truth: for bag-of-words, phrases and
//                                glare; for drives, `truth` is that of QUERIES
//   part=all|first_half|even     of the keyframes that are used
//   start=anywhere|near          of drives: uniform over the map, or 0.3 m, 0.3 m and 30 deg off (Wang et al., Fig. 7)
//   drives=N                     [-] their starts evenly spread
//   config=FILE                  of d2s1r and literal
#include "rivals.h"

#include <d2s1r/localizer.h>
#include <d2s1r/map_io.h>
#include <d2s1r/mrpt.h>
#include <mrpt/obs/CRawlog.h>

#include <cstdio>
#include <ctime>
#include <fstream>
#include <map>
#include <memory>
#include <stdexcept>

#include "../drives.h"
#include "benchmark/literal_query.h"
#include "map/free_cells.h"

namespace d2s1r::rivals
{
namespace
{
using experiments::RunFrame;
using Options = std::map<std::string, std::string>;
/// Holds what a method says of a scan.
struct Answer
{
	Answer() = default;
	/// An answer of a method that never doubts.
	Answer(const std::optional<mrpt::math::TPose2D>& pose)  // NOLINT(google-explicit-constructor): methods return poses
	    : robot(pose), status(pose ? "localized" : "rejected"), confidence(pose ? 1 : 0)
	{
	}

	std::optional<mrpt::math::TPose2D> robot;  //!< robot in map
	std::string status = "rejected";
	double confidence = 0;  //!< [0, 1]
};
using Method = std::function<Answer(const mrpt::obs::CObservation2DRangeScan::Ptr&)>;

std::string get(const Options& options, const std::string& name, const std::string& otherwise)
{
	const auto found = options.find(name);
	return found != options.end() ? found->second : otherwise;
}

std::vector<mrpt::obs::CObservation2DRangeScan::Ptr> load_scans(const std::string& rawlog)
{
	mrpt::obs::CRawlog log;
	if (!log.loadFromRawLogFile(rawlog)) throw std::runtime_error(rawlog + ": cannot be read; check the path");
	std::vector<mrpt::obs::CObservation2DRangeScan::Ptr> scans;
	for (const auto& entry : log)
		if (const auto scan = std::dynamic_pointer_cast<mrpt::obs::CObservation2DRangeScan>(entry))
			scans.push_back(scan);
	return scans;
}

std::vector<Keyframe> load_keyframes(const Options& options)
{
	const std::string rawlog = get(options, "keyframes", ""), part = get(options, "part", "all");
	if (rawlog.empty()) throw std::runtime_error("keyframes: give the rawlog that built the map, and its truth");
	const auto run = experiments::load_run(rawlog, get(options, "truth", ""));
	std::vector<Keyframe> keyframes;
	for (std::size_t i = 0; i < run.size(); i++)
	{
		if ((part == "first_half" && i >= run.size() / 2) || (part == "even" && i % 2 == 1)) continue;
		const Scan scan = make_scan(scan_of(*run[i].scan), {});
		if (!scan.valid()) continue;
		const auto sensor = mrpt::poses::CPose2D(run[i].truth) + mrpt::poses::CPose2D(scan.sensor_on_robot);
		keyframes.push_back({scan, sensor.asTPose()});
	}
	return keyframes;
}

using Map = std::shared_ptr<const OccupancyMap>;

Method make_localizer(const Map& map, const std::string& config)
{
	return [localizer = std::make_shared<const Localizer>(map, load_parameters(config))](const auto& observation)
	{
		const Localization result = localizer->localize(scan_of(*observation));
		Answer answer;
		answer.status = to_string(result.status);
		if (result.hypotheses.empty()) return answer;
		answer.robot = result.best().pose.asTPose();
		answer.confidence = result.confidence;
		return answer;
	};
}

/// The published method as it is typed out for the benchmarks, with its own exact rays.
struct Literal
{
	Literal(const Map& map, const Parameters& p)
	    : scans(p.scan),
	      grid(make_grid(*map, p.grid)),
	      caster(grid, p.paper.max_range),
	      localizer(grid, caster, find_free_cells(grid, p.free_cells))
	{
	}

	ScanParameters scans;
	Grid grid;
	RayCaster caster;
	benchmark::LiteralLocalizer localizer;
};

Method make_literal(const Map& map, const std::string& config)
{
	return [literal = std::make_shared<const Literal>(map, load_parameters(config))](const auto& observation)
	{
		const Scan scan = make_scan(scan_of(*observation), literal->scans);
		constexpr std::size_t kBeams = 360;
		return Answer(scan.beams.size() == kBeams ? std::optional(literal->localizer.localize(scan)) : std::nullopt);
	};
}

Method make_method(const std::string& method, const std::string& map_file, const Options& options)
{
	const auto map = load_map(map_file);
	if (method == "d2s1r") return make_localizer(map, get(options, "config", ""));
	if (method == "literal") return make_literal(map, get(options, "config", ""));
	if (method == "filter")
		return [filter = std::make_shared<ParticleFilter>(*mrpt_grid_of(*map)),
		        seed = std::uint32_t{0}](const mrpt::obs::CObservation2DRangeScan::Ptr& observation) mutable
		{
			filter->start_anywhere(++seed);
			return Answer(filter->step(nullptr, observation));
		};
	Rival rival;
	if (method == "exhaustive") rival = exhaustive_search(make_grid(*map, {}));
	if (method == "branch-and-bound") rival = branch_and_bound(make_grid(*map, {}));
	if (method == "bag-of-words") rival = bag_of_words(load_keyframes(options));
	if (method == "phrases") rival = flirt_phrases(load_keyframes(options));
	if (method == "glare") rival = landmark_relations(load_keyframes(options));
	if (!rival) throw std::runtime_error(method + ": no such method; see the head of rivals.cpp");
	return [rival](const mrpt::obs::CObservation2DRangeScan::Ptr& observation) -> Answer
	{
		const Scan scan = make_scan(scan_of(*observation), {});
		const auto sensor = scan.valid() ? rival(scan) : std::nullopt;
		if (!sensor) return {};
		return std::optional((mrpt::poses::CPose2D(*sensor) + -mrpt::poses::CPose2D(scan.sensor_on_robot)).asTPose());
	};
}

/// [s] of processor time, which other programs on the machine do not change.
double processor_time()
{
	return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// [MB] the peak of what this program itself had in memory: that of getrusage() is inherited from the one that started
/// it.
double peak_memory()
{
	std::ifstream status("/proc/self/status");
	for (std::string word; status >> word;)
		if (double kilobytes = 0; word == "VmHWM:" && status >> kilobytes) return kilobytes / 1024;
	throw std::runtime_error("/proc/self/status: cannot be read");
}

struct File
{
	explicit File(const std::string& name) : stream(std::fopen(name.c_str(), "w"))
	{
		if (!stream) throw std::runtime_error(name + ": cannot be written; check the folder");
	}
	~File() { std::fclose(stream); }
	File(const File&) = delete;
	File& operator=(const File&) = delete;

	std::FILE* stream;
};

void write_row(
    std::FILE* out, std::size_t frame, const mrpt::obs::CObservation& observation, const Answer& answer, double seconds)
{
	std::fprintf(out, "%zu,%.6f,%s,", frame, mrpt::Clock::toDouble(observation.timestamp), answer.status.c_str());
	if (answer.robot)
		std::fprintf(
		    out, "%.6f,%.6f,%.6f,%.6g,", answer.robot->x, answer.robot->y, answer.robot->phi, answer.confidence);
	else
		std::fprintf(out, ",,,,");
	std::fprintf(out, "%.3f\n", 1e3 * seconds);
}

void localize_each(const Method& method, const std::string& queries, const File& out)
{
	std::fprintf(out.stream, "frame,timestamp,status,x,y,phi,confidence,total_ms\n");
	const auto scans = load_scans(queries);
	for (std::size_t i = 0; i < scans.size(); i++)
	{
		const double start = processor_time();
		const Answer answer = method(scans[i]);
		write_row(out.stream, i, *scans[i], answer, processor_time() - start);
	}
}

/// The deviation of a first guess in the paper's Section IV-B.1: 0.3 m, 0.3 m and 30 deg.
mrpt::math::TPose2D off(const mrpt::math::TPose2D& truth)
{
	return {truth.x + 0.3, truth.y + 0.3, truth.phi + M_PI / 6};
}

void follow_drives(ParticleFilter& filter, const std::string& queries, const Options& options, const File& out)
{
	const auto run = experiments::load_run(queries, get(options, "truth", ""));
	const bool is_near = get(options, "start", "anywhere") == "near";
	auto drives = std::vector<experiments::Drive>{experiments::drive_from(run, 0, run.size())};
	if (run.size() > experiments::kDriveFrames)
		drives = experiments::spread_drives(run, std::stoul(get(options, "drives", "20")));
	std::fprintf(out.stream, "drive,frame,timestamp,status,x,y,phi,confidence,total_ms\n");
	for (std::size_t d = 0; d < drives.size(); d++)
	{
		const auto& drive = drives[d];
		const auto seed = static_cast<std::uint32_t>(d + 1);
		is_near ? filter.start_near(off(drive[0]->truth), seed) : filter.start_anywhere(seed);
		for (std::size_t i = 0; i < drive.size(); i++)
		{
			const double start = processor_time();
			const auto motion = i > 0 ? experiments::odometry_between(*drive[i - 1], *drive[i]) : std::nullopt;
			const Answer answer(filter.step(motion ? &*motion : nullptr, drive[i]->scan));
			std::fprintf(out.stream, "%zu,", d);
			write_row(out.stream, i, *drive[i]->scan, answer, processor_time() - start);
		}
	}
}

int run(int argc, char** argv)
{
	if (argc < 5)
	{
		std::fprintf(stderr, "usage: rivals METHOD MAP QUERIES.rawlog OUT.csv [NAME=VALUE ...]\n");
		return 1;
	}
	Options options;
	for (int i = 5; i < argc; i++)
	{
		const std::string word = argv[i];
		options[word.substr(0, word.find('='))] = word.substr(word.find('=') + 1);
	}
	const std::string method = argv[1];
	const double start = processor_time();
	double preparation = 0;  // [s]
	const File out(argv[4]);
	if (method == "drives")
	{
		ParticleFilter filter(*mrpt_grid_of(*load_map(argv[2])));
		preparation = processor_time() - start;
		follow_drives(filter, argv[3], options, out);
	}
	else
	{
		const Method answer = make_method(method, argv[2], options);
		preparation = processor_time() - start;
		localize_each(answer, argv[3], out);
	}
	std::printf("{\"preparation_s\": %.3f, \"memory_mb\": %.1f}\n", preparation, peak_memory());
	return 0;
}
}  // namespace
}  // namespace d2s1r::rivals

int main(int argc, char** argv)
{
	try
	{
		return d2s1r::rivals::run(argc, argv);
	}
	catch (const std::exception& error)
	{
		std::fprintf(stderr, "rivals: %s\n", error.what());
		return 1;
	}
}
