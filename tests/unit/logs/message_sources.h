// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Made recordings, and what is read of them.
#pragma once

#include <logs/errors.h>

#include <random>

#include "app/temporary_folder.h"
#include "bags/message_source.h"
#include "logs/made_logs.h"

namespace d2s1r::test
{
using namespace d2s1r::logs;

inline constexpr std::int64_t kSecond = 1'000'000'000;

/// Ten scans with other messages between them, which are not read.
inline std::vector<MadeMessage> recording(Wire wire)
{
	std::vector<MadeMessage> messages;
	for (std::int64_t i = 0; i < 10; i++)
	{
		MadeScan scan;
		scan.time = 1600 * kSecond + i * kSecond / 10;
		messages.push_back(made_scan(wire, scan));
		messages.push_back({"/chatter", "std_msgs/String", scan.time + 1, FieldWriter(wire).text("hello").bytes()});
	}
	return messages;
}

inline std::vector<std::int64_t> times_of(const std::vector<MadeMessage>& messages)
{
	std::vector<std::int64_t> times;
	for (const auto& message : messages)
		if (message.topic != "/chatter") times.push_back(message.time);
	return times;
}

struct Reading
{
	std::vector<std::int64_t> times;
	std::vector<std::string> topics;
	std::vector<std::string> data;
	std::string damage;
};

inline Reading read_all(MessageSource& source)
{
	Reading reading;
	while (const auto message = source.next())
	{
		reading.times.push_back(message->time);
		reading.topics.push_back(message->topic->name);
		reading.data.emplace_back(reinterpret_cast<const char*>(message->data.data), message->data.size);
	}
	EXPECT_FALSE(source.next());  // nor does it start again
	reading.damage = source.damage();
	return reading;
}
class MessageSources : public FolderTest
{
   protected:
	Reading read_file(const std::string& content, RosFormat format) const
	{
		write("log", content);
		const auto source = open_messages(path("log"), format);
		return read_all(*source);
	}

	/// Reads a file and returns what is wrong with it; it may hold more than one would keep.
	std::string damage_of(const std::string& content, RosFormat format) const
	{
		write("log", content);
		const auto source = open_messages(path("log"), format);
		while (source->next()) EXPECT_EQ(source->damage(), "") << "is told after all that was read";
		return source->damage();
	}

	/// Expects that whatever is cut off or altered, the reading ends, and that nothing of it was made up.
	void expect_no_harm(const std::string& whole, RosFormat format) const
	{
		std::mt19937 random(7);  // NOLINT: the same bytes each time
		const auto below = [&](std::size_t limit) { return random() % limit; };
		for (int i = 0; i < 300; i++)
		{
			std::string file = whole;
			if (i % 3 == 0)
				file.resize(below(file.size()));
			else
				for (int j = 0; j < 4; j++) file[below(file.size())] = static_cast<char>(below(256));
			try
			{
				EXPECT_LE(read_file(file, format).times.size(), 10000U);
			}
			catch (const LogError& e)
			{
			}
		}
	}
};
}  // namespace d2s1r::test
