// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "environment.h"

#include <shell/errors.h>
#include <shell/values.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <stdexcept>

namespace d2s1r::live
{
namespace
{
std::string variable(const char* name)
{
	const char* const value = std::getenv(name);
	return value != nullptr ? value : "";
}

/// Returns the range that peers are looked for in, in capitals.
std::string range_of_discovery()
{
	if (variable("ROS_LOCALHOST_ONLY") == "1") return "LOCALHOST";  // which wins in ROS, too
	std::string range = variable("ROS_AUTOMATIC_DISCOVERY_RANGE");
	std::transform(range.begin(), range.end(), range.begin(), [](unsigned char c) { return std::toupper(c); });
	for (const char* const known : {"SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT"})
		if (range == known) return range;
	if (!range.empty())
		throw app::UserError(
		    app::kWrongUse, "ROS_AUTOMATIC_DISCOVERY_RANGE",
		    "'" + range + "' is not one of SUBNET, LOCALHOST, OFF, SYSTEM_DEFAULT");
	return "SUBNET";
}

std::string static_peers()
{
	std::string peers;
	std::istringstream in(variable("ROS_STATIC_PEERS"));
	for (std::string peer; std::getline(in, peer, ';');)
	{
		if (peer.find_first_of("<>&\"'") != std::string::npos)
			throw app::UserError(app::kWrongUse, "ROS_STATIC_PEERS", "'" + peer + "' is not an address");
		if (!peer.empty()) peers += "<Peer address=\"" + peer + "\"/>";
	}
	return peers;
}

std::string settings_of(const std::string& general, const std::string& discovery)
{
	return "<CycloneDDS><Domain>" + (general.empty() ? "" : "<General>" + general + "</General>") + "<Discovery>" +
	       discovery + "</Discovery></Domain></CycloneDDS>";
}

/// Returns the settings of a range. Nodes that are only to be found on this machine differ: those of Humble use
/// the loopback interface alone, with multicast (Fast DDS) or without (Cyclone DDS); later ones use the network's
/// interface, and look for each other at the ports of this machine. All of them are found by both ways together.
std::vector<std::string> settings_of_range(const std::string& range)
{
	constexpr const char* kPorts =
	    "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>";
	constexpr const char* kLoopback = "<NetworkInterface address=\"127.0.0.1\" multicast=\"true\"/>";
	constexpr const char* kOther = "<NetworkInterface autodetermine=\"true\" multicast=\"false\"/>";
	const auto peers = [&](const std::string& all) { return std::string(kPorts) + "<Peers>" + all + "</Peers>"; };
	const auto interfaces = [](const std::string& all) { return "<Interfaces>" + all + "</Interfaces>"; };
	const std::string given = static_peers(), here = "<Peer address=\"127.0.0.1\"/>";
	if (range == "OFF")  // nobody else has this tag
		return {settings_of(
		    "", "<ParticipantIndex>none</ParticipantIndex><Tag>off " + std::to_string(getpid()) + "</Tag>")};
	if (range == "LOCALHOST")
		return {
		    settings_of(interfaces(std::string(kLoopback) + kOther), peers(here + given)),
		    settings_of(interfaces(kLoopback), peers(here + given))};
	if (range == "SUBNET" && !given.empty()) return {settings_of("", peers(given))};
	return {""};
}
}  // namespace

std::uint32_t domain_of_environment()
{
	const std::string text = variable("ROS_DOMAIN_ID");
	try
	{
		return text.empty() ? 0 : static_cast<std::uint32_t>(parse_whole_number(text, 0, kGreatestDomain));
	}
	catch (const std::invalid_argument& error)
	{
		throw app::UserError(app::kWrongUse, "ROS_DOMAIN_ID", error.what());
	}
}

Discovery discovery_of_environment()
{
	Discovery discovery{settings_of_range(range_of_discovery()), {}};
	const std::string middleware = variable("RMW_IMPLEMENTATION");
	if (!middleware.empty() && middleware != "rmw_cyclonedds_cpp" && middleware.find("rmw_fastrtps") != 0 &&
	    middleware != "rmw_connextdds")
		discovery.notes.push_back(
		    "RMW_IMPLEMENTATION is " + middleware +
		    ", whose nodes d2s1r-live cannot join: it speaks DDS; start them with rmw_cyclonedds_cpp or "
		    "rmw_fastrtps_cpp");
	if (const std::string server = variable("ROS_DISCOVERY_SERVER"); !server.empty())
		discovery.notes.push_back(
		    "ROS_DISCOVERY_SERVER is " + server +
		    ", which d2s1r-live cannot join: it finds nodes without a server; leave it out, or name their machines in "
		    "ROS_STATIC_PEERS");
	return discovery;
}
}  // namespace d2s1r::live
