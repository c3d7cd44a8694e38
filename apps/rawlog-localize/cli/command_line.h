// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/fused_pose.h>
#include <d2s1r/map_io.h>
#include <d2s1r/prior.h>
#include <logs/log.h>
#include <ros/monitor.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "cli/console.h"

namespace d2s1r::app
{
/// Starts what --ground-truth or --check says if it names a topic of the log instead of a file.
inline constexpr const char* kTopicPrefix = "topic:";

/// Starts it if it names a frame of the log, in which the transforms tell where the robot was.
inline constexpr const char* kFramePrefix = "tf:";

struct MapRequest
{
	std::vector<std::string> files;      //!< maps, or one atlas: see read_atlas()
	std::optional<ImageGeometry> image;  //!< only if the map is an image
	std::string index;                   //!< file of the saved index, of an atlas its folder; empty: none

	/// Returns the map as messages name it. There is one.
	const std::string& name() const { return files.front(); }
};

/// Scan frames first, first + step, first + 2 step, ... below past, counted from 0.
struct FrameRange
{
	std::size_t first = 0;
	std::size_t past = std::numeric_limits<std::size_t>::max();
	std::size_t step = 1;
};

/// The log, what of it is used, and what of it is read in another way than it says.
struct LogRequest
{
	std::string file;
	std::optional<std::string> label;             //!< of a laser; without a value, the one with the most scans
	const char* label_option = "--sensor-label";  //!< that gives the label, as messages name it
	bool merge_lasers = false;                    //!< whether the other lasers' scans are used, too
	logs::Overrides overrides;                    //!< they are about that laser
	bool is_as_told = false;                      //!< whether messages are believed that the drive contradicts
	std::optional<ros::HeightBand> cloud_height;  //!< of the points that make scans; without a value, no clouds
	FrameRange frames;
	bool follow = false;       //!< whether the log is a file that grows
	std::string ground_truth;  //!< empty: no ground truth
	std::string check;         //!< poses of a tracker that is judged; empty: there is none
	WatchSettings watch;

	bool is_live() const { return follow || file == logs::kStandardInput; }

	/// Returns the log as messages name it.
	std::string name() const { return file == logs::kStandardInput ? "standard input" : file; }
};

struct SearchRequest
{
	std::string config;                         //!< empty: default parameters
	std::vector<std::string> settings;          //!< "SECTION.KEY=VALUE", which win over it
	int threads = 1;                            //!< [-] that localize scans, and that build the index of method = paper
	std::optional<int> window;                  //!< [-] scans that are used jointly; without a value, each on its own
	Query query = {{}, 0, interrupted};         //!< the same for every scan
	bool track = false;                         //!< whether a Tracker follows the robot
	bool fuse = false;                          //!< whether a particle filter follows the results
	MotionSource motion = MotionSource::kBoth;  //!< what moves it
	std::uint32_t seed = 1;                     //!< [-] of it
	std::string plugins;                        //!< comma-separated modules
};

struct OutputRequest
{
	std::string folder;        //!< empty: none
	std::string save_map;      //!< empty: not saved
	std::string write_config;  //!< empty: not written
	std::string write_pf_ini;  //!< empty: not written
	bool rawlog_copy = true;   //!< whether localized.rawlog is written
	bool stream = false;       //!< whether a line for each frame is printed
	bool diagnose = false;     //!< whether only mistakes are looked for
	bool calibrate = false;    //!< whether it is only said what the drive shows of the laser
	bool quiet = false;
};

/// The command line of rawlog-localize. It has been checked for consistency; no file has been touched.
struct CommandLine
{
	MapRequest map;
	LogRequest log;
	SearchRequest search;
	OutputRequest output;
	std::vector<std::string> words;            //!< as they were given
	std::map<std::string, std::string> given;  //!< text by the long name of each option that was given

	bool only_writes_config() const { return map.files.empty() && log.file.empty() && output.folder.empty(); }
};

/// Parses the command line. Returns nothing if --help or --version was asked for, after printing it on `out`.
/// \throws UserError (kWrongUse)
std::optional<CommandLine> parse_command_line(int argc, char** argv, std::ostream& out);
}  // namespace d2s1r::app
