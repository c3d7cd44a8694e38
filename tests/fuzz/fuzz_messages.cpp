// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Any messages in a sound bag or MCAP file. The case is not the file but what its messages are made of: the target
// writes them, field by field or as any bytes, into chunks, and these into a file with the right sizes and checksums.
// So the fuzzer changes what a reader finds behind them, which target log does not get at.
#include <d2s1r/mrpt.h>
#include <d2s1r/scan.h>
#include <logs/errors.h>
#include <logs/log.h>

#include "fuzz_input.h"
#include "logs/made_logs.h"

namespace
{
using namespace d2s1r;
using namespace d2s1r::test;
using fuzz::Numbers;

constexpr int kMostMessages = 60;

/// Returns one of a few names, most of which are given to frames.
std::string any_frame(Numbers& numbers)
{
	constexpr const char* kNames[] = {"base_link", "laser", "odom", "map", "base_footprint", "/laser", ""};
	const unsigned choice = numbers.byte() % (std::size(kNames) + 1);
	return choice < std::size(kNames) ? kNames[choice] : std::string(1, static_cast<char>(numbers.byte()));
}

std::string any_bytes(Numbers& numbers)
{
	std::string bytes;
	for (int i = numbers.whole(0, 200); i > 0; i--) bytes += static_cast<char>(numbers.byte());
	return bytes;
}

std::int64_t any_time(Numbers& numbers)
{
	constexpr std::int64_t kStart = 1'600'000'000'000'000'000, kStep = 10'000'000;  // [ns]
	if (numbers.byte() >= 8) return kStart + kStep * numbers.byte();
	std::int64_t any = 0;
	for (int i = 0; i < 8; i++) any = any * 128 + numbers.byte() % 128;
	return any;
}

MadeMessage any_scan(Wire wire, Numbers& numbers)
{
	MadeScan scan;
	scan.time = any_time(numbers);
	scan.frame = any_frame(numbers);
	scan.first_angle = static_cast<float>(numbers.odd(-3.2, 3.2));
	scan.angle_step = static_cast<float>(numbers.odd(-0.1, 0.1));
	scan.min_range = static_cast<float>(numbers.odd(0, 0.2));
	scan.max_range = static_cast<float>(numbers.odd(0, 30));
	scan.ranges.assign(static_cast<std::size_t>(numbers.whole(0, 60)), 1.0F);
	for (float& range : scan.ranges) range = static_cast<float>(numbers.odd(0, 10));
	return made_scan(wire, scan, numbers.flip() ? "/scan" : "/front");
}

MadeMessage any_transforms(Wire wire, Numbers& numbers)
{
	std::vector<MadeTransform> transforms;
	for (int i = numbers.byte() % 6; i > 0; i--)
		transforms.push_back(
		    {any_frame(numbers), any_frame(numbers), numbers.odd(-1, 1), numbers.odd(-1, 1), numbers.odd(-1, 1),
		     "xyz"[numbers.byte() % 3], numbers.odd(-4, 4)});
	return made_transforms(wire, any_time(numbers), transforms, numbers.flip() ? "/tf" : "/tf_static");
}

MadeMessage any_message(Wire wire, Numbers& numbers)
{
	const unsigned kind = numbers.byte() % 8;
	MadeMessage message =
	    kind % 4 < 2 ? any_scan(wire, numbers)
	    : kind % 4 == 2
	        ? any_transforms(wire, numbers)
	        : made_odometry(wire, any_time(numbers), numbers.odd(-9, 9), numbers.odd(-9, 9), numbers.odd(-4, 4));
	if (kind < 4) return message;
	// The same as any bytes, cut short, or with some bytes changed.
	if (numbers.byte() < 64) message.data = any_bytes(numbers);
	message.data.resize(std::min<std::size_t>(message.data.size(), static_cast<std::size_t>(numbers.whole(0, 600))));
	for (int i = numbers.byte() % 8; i > 0 && !message.data.empty(); i--)
		message.data[static_cast<std::size_t>(numbers.whole(0, 65535)) % message.data.size()] =
		    static_cast<char>(numbers.byte());
	return message;
}

std::string any_file(Numbers& numbers)
{
	constexpr const char* kMethods[] = {"", "", "lz4", "bz2", "zstd"};
	const bool is_bag = numbers.flip();
	const Wire wire = is_bag ? Wire::kRos1 : Wire::kCdr;
	Packing packing;
	packing.method = kMethods[numbers.byte() % std::size(kMethods)];
	if (!can_pack(packing.method) || packing.method == (is_bag ? "zstd" : "bz2")) packing.method.clear();
	packing.messages_in_chunk = static_cast<std::size_t>(numbers.whole(is_bag ? 1 : 0, 20));
	packing.with_index = numbers.flip();
	std::vector<MadeMessage> messages;
	while (!numbers.empty() && messages.size() < kMostMessages) messages.push_back(any_message(wire, numbers));
	return is_bag ? bag1_file(messages, packing) : mcap_file(messages, packing);
}
}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
	static const fuzz::CaseFile file("messages");
	Numbers numbers(data, size);
	const std::string bytes = any_file(numbers);
	file.write(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
	try
	{
		const logs::Log log = logs::open_log(file.path());
		if (!log.survey.damage.empty()) fuzz::require_one_line(log.survey.damage);
		const auto reader = log.read();
		std::size_t scans = 0, counted = 0;
		while (const auto object = reader->next())
			for (const auto& scan : object->scans)
			{
				scans++;
				const Scan read = make_scan(*scan, {});
				const mrpt::math::TPose2D& mounting = read.sensor_on_robot;
				fuzz::require(
				    !read.valid() || std::isfinite(mounting.x + mounting.y + mounting.phi),
				    "a sensor that is somewhere");
			}
		for (const logs::Sensor& sensor : log.survey.sensors) counted += sensor.scans;
		if (!reader->damage().empty()) fuzz::require_one_line(reader->damage());
		fuzz::require(scans <= counted, "no more scans than the survey counted");
		fuzz::require(scans == counted || !reader->damage().empty(), "why there are fewer scans than counted");
	}
	catch (const logs::LogError& error)
	{
		fuzz::require_one_line(error.what());
	}
	return 0;
}
