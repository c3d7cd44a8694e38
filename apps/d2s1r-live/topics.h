// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The topics of d2s1r-live.
#pragma once

#include <deque>
#include <optional>

#include "dds.h"
#include "flags.h"
#include "ros.h"

namespace d2s1r::live
{
struct Topics
{
	Topics(const Flags& flags, const Place& place)
	    : maps(place, nav_msgs_msg_dds__OccupancyGrid__desc, flags.map_topic, {true, !flags.volatile_map, 1}),
	      transforms(place, tf2_msgs_msg_dds__TFMessage__desc, "/tf", {true, false, 100, true}),
	      static_transforms(place, tf2_msgs_msg_dds__TFMessage__desc, "/tf_static", {true, true, 100}),
	      odometry(place, nav_msgs_msg_dds__Odometry__desc, flags.odometry, {false, false, 50}),
	      clock(place, rosgraph_msgs_msg_dds__Clock__desc, "/clock", {false, false, 1}),
	      requests(place, std_msgs_msg_dds__Empty__desc, "d2s1r/localize", {true, false, 1}),
	      seeds(place, geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, flags.seeds, {true, false, 1}),
	      poses(place, geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, "d2s1r/pose", {true, false, 10}),
	      hypotheses(place, geometry_msgs_msg_dds__PoseArray__desc, "d2s1r/hypotheses", {true, true, 1}),
	      markers(place, visualization_msgs_msg_dds__MarkerArray__desc, "d2s1r/markers", {true, true, 1}),
	      diagnostics(place, diagnostic_msgs_msg_dds__DiagnosticArray__desc, "/diagnostics", {true, false, 10}),
	      waiter(place.participant)
	{
		for (const std::string& topic : flags.scans)
			scans.emplace_back(
			    place,
			    flags.settings.cloud_height ? sensor_msgs_msg_dds__PointCloud2__desc
			                                : sensor_msgs_msg_dds__LaserScan__desc,
			    topic, Quality{false, false, 5});
		for (const std::string& topic : flags.trackers)
			trackers.emplace_back(
			    place, geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, topic, Quality{false, false, 10});
		if (flags.settings.track)
		{
			tracked_transforms.emplace(place, tf2_msgs_msg_dds__TFMessage__desc, "/tf", Quality{true, false, 100});
			suggestions.emplace(
			    place, geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, flags.seeds,
			    Quality{true, false, 1, true});
		}
		for (const Endpoint* reader : readers()) waiter.add(*reader);
	}

	std::vector<Endpoint*> readers()
	{
		std::vector<Endpoint*> all = {&maps, &transforms, &static_transforms, &odometry, &clock, &requests};
		for (auto& scan : scans) all.push_back(&scan);
		for (auto& tracker : trackers) all.push_back(&tracker);
		if (suggestions) all.push_back(&*suggestions);
		return all;
	}

	std::vector<Endpoint*> writers()
	{
		std::vector<Endpoint*> all = {&seeds, &poses, &hypotheses, &markers, &diagnostics};
		if (tracked_transforms) all.push_back(&*tracked_transforms);
		return all;
	}

	std::deque<Reader> scans, trackers;
	std::optional<Reader> suggestions;                                       // with --track
	std::optional<Writer<tf2_msgs_msg_dds__TFMessage_>> tracked_transforms;  // with --track
	Reader maps, transforms, static_transforms, odometry, clock, requests;
	Writer<geometry_msgs_msg_dds__PoseWithCovarianceStamped_> seeds, poses;
	Writer<geometry_msgs_msg_dds__PoseArray_> hypotheses;
	Writer<visualization_msgs_msg_dds__MarkerArray_> markers;
	Writer<diagnostic_msgs_msg_dds__DiagnosticArray_> diagnostics;
	Waiter waiter;
};
}  // namespace d2s1r::live
