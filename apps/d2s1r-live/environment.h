// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What the environment of a node of ROS 2 says about which peers it finds.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace d2s1r::live
{
struct Discovery
{
	/// Configurations of Cyclone DDS, of which the first that it accepts is used. An empty text changes nothing.
	std::vector<std::string> settings;
	std::vector<std::string> notes;  //!< for people: what this program cannot join
};

inline constexpr std::uint32_t kGreatestDomain = 232;  //!< of which all ports exist

/// Returns the domain that ROS_DOMAIN_ID names, 0 without it. \throws UserError (kWrongUse)
std::uint32_t domain_of_environment();

/// Reads ROS_LOCALHOST_ONLY, ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_STATIC_PEERS, ROS_DISCOVERY_SERVER and
/// RMW_IMPLEMENTATION. \throws UserError (kWrongUse) if a value is none of those that ROS knows
Discovery discovery_of_environment();
}  // namespace d2s1r::live
