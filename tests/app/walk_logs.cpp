// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "walk_logs.h"

#include <cmath>
#include <cstdio>

#include "app_world.h"

namespace d2s1r::test
{
namespace
{
std::int64_t nanoseconds(std::size_t i)
{
	return std::llround(walk_time(i) * 10) * 100'000'000;
}
}  // namespace

MadeScan ros_scan(std::size_t i, bool clockwise)
{
	const auto observation = walk_scan(i);
	const auto beams = observation->getScanSize();
	MadeScan scan;
	scan.time = nanoseconds(i);
	scan.first_angle = -observation->aperture / 2;
	scan.angle_step = observation->aperture / static_cast<float>(beams - 1);
	scan.min_range = 0;
	scan.max_range = observation->maxRange;
	scan.ranges.clear();
	for (std::size_t beam = 0; beam < beams; beam++)
		scan.ranges.push_back(observation->getScanRange(clockwise ? beams - 1 - beam : beam));
	return scan;
}

std::vector<MadeMessage> ros_walk(Wire wire, bool upside_down)
{
	std::vector<MadeMessage> messages;
	const char axis = upside_down ? 'x' : 'z';
	messages.push_back(made_transforms(
	    wire, nanoseconds(0) - 1000, {{"base_link", "laser", 0.1, 0, 0.2, axis, upside_down ? M_PI : 0}}));
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		messages.push_back(made_odometry(wire, nanoseconds(i) - 10, walk()[i].x, walk()[i].y, walk()[i].phi));
		messages.push_back(made_scan(wire, ros_scan(i, upside_down)));
	}
	return messages;
}

std::string carmen_walk()
{
	std::string log = "PARAM robot_frontlaser_offset 0.1 1 host 1\n";
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		const MadeScan scan = ros_scan(i);
		char text[100];
		log += "ROBOTLASER1 0 " + std::to_string(scan.first_angle) + " 6.28 " + std::to_string(scan.angle_step) + " " +
		       std::to_string(scan.max_range) + " 0.01 0 " + std::to_string(scan.ranges.size());
		for (const float range : scan.ranges) log += " " + std::to_string(range);
		std::snprintf(text, sizeof text, " 0 0.1 0 0 0 0 0 0 0 0 0 0 %.6f host 0\n", walk_time(i));
		log += text;
	}
	return log;
}
}  // namespace d2s1r::test
