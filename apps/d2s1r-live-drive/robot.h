// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The nodes of a simulated robot, as peers of d2s1r-live.
#pragma once

#include <ros/messages.h>

#include <optional>

#include "dds.h"
#include "drive.h"
#include "environment.h"
#include "messages.h"
#include "ros.h"

namespace d2s1r::drive
{
using live::Reader;
using live::Writer;
using mrpt::poses::CPose2D;

using Pose = geometry_msgs_msg_dds__PoseWithCovarianceStamped_;
inline std::string kMap = "map", kOdometry = "odom", kRobot = "base_link", kLaser = "laser";  // frames
inline const auto& kPoseType = geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc;

inline std_msgs_msg_dds__Header_ header_of(live::Time time, std::string& frame)
{
	return {live::to_stamp(time), frame.data()};
}

struct Participant
{
	explicit Participant(const DriveSettings& settings)
	    : domain(live::open_domain(settings.domain, live::discovery_of_environment().settings)),
	      entity(live::join_domain(settings.domain)),
	      place{entity, settings.names}
	{
	}
	live::Entity domain, entity;
	live::Place place;
};

template <typename Decode, typename Use>
void take(Reader& reader, const Decode& decode, const Use& use)
{
	reader.take([&](ros::Bytes bytes, std::uint64_t) { use(decode({bytes, ros::Encoding::kCdr})); });
}

/// What the nodes of a robot publish, and what is read there.
struct Robot
{
	explicit Robot(const DriveSettings& settings)
	    : participant(settings),
	      transforms(participant.place, tf2_msgs_msg_dds__TFMessage__desc, "tf", {true, false, 100}),
	      static_transforms(participant.place, tf2_msgs_msg_dds__TFMessage__desc, "tf_static", {true, true, 1}),
	      odometry(participant.place, nav_msgs_msg_dds__Odometry__desc, "odom", {true, false, 10}),
	      scans(participant.place, sensor_msgs_msg_dds__LaserScan__desc, "scan", {false, false, 5}),
	      poses(participant.place, kPoseType, "d2s1r/pose", {true, false, 10}),
	      tracker(participant.place, kPoseType, "amcl_pose", {true, true, 1}),
	      told_transforms(participant.place, tf2_msgs_msg_dds__TFMessage__desc, "tf", {true, false, 100, true}),
	      markers(participant.place, visualization_msgs_msg_dds__MarkerArray__desc, "d2s1r/markers", {true, true, 1}),
	      waiter(participant.entity)
	{
		waiter.add(poses);
		waiter.add(tracker);
		waiter.add(told_transforms);
		if (!settings.leaves_map)
			map.emplace(participant.place, nav_msgs_msg_dds__OccupancyGrid__desc, "map", live::Quality{true, true, 1});
	}

	/// Publishes the map, and where the laser is.
	void begin(const Grid& grid)
	{
		const live::Time now = live::wall_clock();
		static_transforms.write(live::transform_message(now, kRobot, kLaser, kLaserOnRobot).message);
		if (!map) return;
		std::vector<std::int8_t> percent;
		for (const Cell cell : grid.cells)
			percent.push_back(static_cast<std::int8_t>(cell == Cell::kFree ? 0 : cell == Cell::kOccupied ? 100 : -1));
		nav_msgs_msg_dds__OccupancyGrid_ message{};
		message.header = header_of(now, kMap);
		message.info.resolution = static_cast<float>(grid.cell_size);
		message.info.width = static_cast<std::uint32_t>(grid.width);
		message.info.height = static_cast<std::uint32_t>(grid.height);
		message.info.origin.position = {grid.origin_x, grid.origin_y, 0};
		message.info.origin.orientation.w = 1;
		live::point_to(message.data, percent);
		map->write(message);
	}

	void publish_odometry(live::Time time, const CPose2D& pose)
	{
		transforms.write(live::transform_message(time, kOdometry, kRobot, pose).message);
		nav_msgs_msg_dds__Odometry_ message{};
		message.header = header_of(time, kOdometry);
		message.child_frame_id = kRobot.data();
		message.pose.pose = live::to_message(pose);
		odometry.write(message);
	}

	void publish_scan(live::Time time, World& world, const DriveSettings& settings)
	{
		auto ranges = world.scan();
		sensor_msgs_msg_dds__LaserScan_ message{};
		message.header = header_of(time, kLaser);
		message.angle_min = static_cast<float>(world.first_angle());
		message.angle_increment = static_cast<float>(world.angle_step());
		message.angle_max = message.angle_min + message.angle_increment * static_cast<float>(ranges.size() - 1);
		message.range_min = 0.05F;
		message.scan_time = static_cast<float>(settings.scan_time);
		message.range_max = static_cast<float>(settings.world.range);
		live::point_to(message.ranges, ranges);
		scans.write(message);
	}

	Participant participant;
	std::optional<Writer<nav_msgs_msg_dds__OccupancyGrid_>> map;  //!< none if somebody else publishes it
	Writer<tf2_msgs_msg_dds__TFMessage_> transforms, static_transforms;
	Writer<nav_msgs_msg_dds__Odometry_> odometry;
	Writer<sensor_msgs_msg_dds__LaserScan_> scans;
	Reader poses, tracker, told_transforms, markers;
	live::Waiter waiter;
};
}  // namespace d2s1r::drive
