// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/CFusionBackend.h>
#include <d2s1r/map_io.h>
#include <d2s1r/prior.h>
#include <logs/log.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace d2s1r::app
{
/// Starts what --ground-truth says if it names a topic of the log instead of a file.
inline constexpr const char* kTopicPrefix = "topic:";

/// The command line of rawlog-localize. It has been checked for consistency; no file has been touched.
struct Flags
{
	std::string map;                     //!< a map, or an atlas: see read_atlas()
	std::vector<std::string> more_maps;  //!< if --map was given several times: all but the first
	std::string rawlog;
	std::string output_dir;
	std::string config;        //!< empty: default parameters
	std::string ground_truth;  //!< empty: no ground truth
	std::string plugins;       //!< comma-separated modules
	std::string index;         //!< file of the saved index, of an atlas its folder; empty: none
	std::string save_map;      //!< empty: not saved
	std::string write_config;  //!< empty: not written
	std::string write_pf_ini;  //!< empty: not written

	std::optional<std::string> sensor_label;  //!< without a value, the one with the most scans
	bool merge_lasers = false;                //!< whether the other lasers' scans are used, too
	logs::Overrides overrides;                //!< they are about that laser
	std::size_t first_frame = 0;              //!< [-] scan frames first_frame, first_frame + frame_step, ...
	                                          //!< below past_frame are localized
	std::size_t past_frame = std::numeric_limits<std::size_t>::max();
	std::size_t frame_step = 1;
	int threads = 1;                     //!< [-] that localize scans, and that build the index of method = paper
	std::optional<int> window;           //!< [-] scans that are used jointly; without a value, each on its own
	Query query;                         //!< the same for every scan
	std::uint32_t seed = 1;              //!< [-] of the particle filter
	std::optional<ImageGeometry> image;  //!< only if the map is an image

	bool fuse = false;
	MotionSource motion = MotionSource::kBoth;  //!< what moves the particle filter
	bool rawlog_copy = true;                    //!< whether localized.rawlog is written
	bool follow = false;                        //!< whether the log is a file that grows
	bool stream = false;                        //!< whether a line for each frame is printed
	bool diagnose = false;                      //!< whether only mistakes are looked for
	bool quiet = false;

	std::vector<std::string> words;            //!< the command line as it was given
	std::map<std::string, std::string> given;  //!< text by the long name of each option that was given

	/// Returns whether the log is read while it is being written.
	bool is_live() const { return follow || rawlog == logs::kStandardInput; }

	/// Returns the log as messages name it.
	std::string log_name() const { return rawlog == logs::kStandardInput ? "standard input" : rawlog; }

	/// Returns whether the command line only asks for a configuration file to be written.
	bool only_writes_config() const { return map.empty() && rawlog.empty() && output_dir.empty(); }
};

/// Parses the command line. Returns nothing if --help or --version was asked for, after printing it on `out`.
/// \throws UserError (kWrongUse)
std::optional<Flags> parse_flags(int argc, char** argv, std::ostream& out);
}  // namespace d2s1r::app
