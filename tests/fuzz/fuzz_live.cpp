// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What d2s1r-live does with messages of ROS 2 that hold anything. A case is a row of messages: a byte for the topic,
// two for the length, and the message as it is sent, with its encapsulation. Middleware checks only some of it.
#include <base/errors.h>
#include <live/live_localizer.h>

#include <algorithm>
#include <memory>

#include "fuzz_input.h"
#include "mrpt_types.h"

namespace
{
using namespace d2s1r;
using namespace d2s1r::live;

constexpr Time kStep = kSecond / 10;  // [ns] of the clock between two messages

/// A room of 3 x 2 m that every case is localized in.
std::shared_ptr<const Atlas> room()
{
	const auto map =
	    test::make_map(test::enlarge({"########", "#......#", "#..#...#", "#......#", "#....###", "########"}, 5), 0.1);
	Parameters parameters;
	const auto localizer = std::make_shared<const Localizer>(map, parameters);
	return std::make_shared<const Atlas>(std::vector<AtlasMap>{{"map", localizer}});
}

/// Takes a message of the topic with this number.
void take(LiveLocalizer& live, unsigned topic, const ros::EncodedMessage& message)
{
	switch (topic % 8)
	{
		case 0:
		case 1:
			return live.add_scan(topic % 2 == 0 ? "/scan" : "/rear", ros::decode_laser_scan(message));
		case 2:
			return live.add_cloud("/scan", ros::decode_point_cloud(message));
		case 3:
			return live.add_transforms(ros::decode_transforms(message), topic >= 8);
		case 4:
			return live.add_odometry(ros::decode_odometry(message));
		case 5:
		{
			const auto pose = ros::decode_stamped_pose(message);
			return live.add_tracker_pose(pose.header, pose.pose);
		}
		case 6:
			return live.add_map(ros::decode_occupancy_grid(message), 1);
		default:
			live.update(ros::decode_clock(message));
	}
}

void check(const ScanAnswer& answer)
{
	if (answer.seed)
		fuzz::require(std::isfinite(answer.seed->pose.x() + answer.seed->pose.phi()), "a seed that is somewhere");
	for (const Hypothesis& hypothesis : answer.localization.hypotheses)
		fuzz::require(std::isfinite(hypothesis.pose.x() + hypothesis.pose.phi()), "a pose that is somewhere");
}
}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
	static const auto maps = room();
	fuzz::Numbers numbers(data, size);
	LiveSettings settings;
	settings.seeding = Seeding::kWatch;
	settings.merge_lasers = numbers.flip();
	settings.window = numbers.flip() ? 3 : 1;
	settings.cloud_height = ros::HeightBand{0.1, 2};
	settings.has_maps_of_its_own = numbers.flip();
	LiveLocalizer live(settings);
	if (settings.has_maps_of_its_own) live.use_maps(maps);
	live.set_map_publishers({1});
	live.set_tracker_readers(1, 1);
	Time now = 1'600'000'000 * kSecond;
	while (!numbers.empty())
	{
		const unsigned topic = numbers.byte();
		std::vector<std::uint8_t> bytes(static_cast<std::size_t>(numbers.whole(0, 4095)));
		for (std::uint8_t& byte : bytes) byte = numbers.byte();
		try
		{
			take(live, topic, {{bytes.data(), bytes.size()}, ros::Encoding::kCdr});
		}
		catch (const std::runtime_error& e)
		{
			fuzz::require_one_line(one_line(e));
		}
		for (const ScanAnswer& answer : live.update(now += kStep)) check(answer);
		fuzz::require_one_line(live.status(now).summary);
		for (const auto& line : live.take_news()) fuzz::require_one_line(line.text);
	}
	return 0;
}
