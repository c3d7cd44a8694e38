// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <live/live_localizer.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "environment.h"
#include "ros_arguments.h"

namespace d2s1r::live
{
/// The command line of d2s1r-live. It has been checked for consistency; no file but the calibration has been read.
struct Flags
{
	LiveSettings settings;                //!< without the parameters of --config
	std::string map;                      //!< file or atlas; empty: messages bring the map
	std::string config;                   //!< empty: default parameters
	std::vector<std::string> parameters;  //!< "SECTION.KEY=VALUE", which win over `config`
	std::string calibration;              //!< file, whose values are in `settings`; empty: none
	std::string index;                    //!< file that keeps the index of a map; empty: none
	std::uint32_t domain = 0;
	Discovery discovery;
	Names names;                     //!< of the node and its topics
	bool ignores_clock = false;      //!< whether /clock is not followed
	std::vector<std::string> notes;  //!< for people, before anything is done
	bool volatile_map = false;       //!< whether the publisher of the map is volatile
	bool quiet = false;

	// Names of topics, which Flags::names resolves.
	std::vector<std::string> scans = {"scan"};  //!< of PointCloud2 if LiveSettings::cloud_height has a value
	std::string map_topic = "map";
	std::string odometry = "odom";
	std::vector<std::string> trackers = {"amcl_pose", "pf_pose"};
	std::string seeds = "initialpose";
};

/// Parses the command line, arguments of ROS included, and reads the environment of the node. Returns nothing if --help
/// or --version was asked for, after printing it. \throws UserError (kWrongUse)
std::optional<Flags> parse_flags(int argc, char** argv, std::ostream& out);
}  // namespace d2s1r::live
