// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Logs of ten and a hundred times as many messages, chunks, topics, lasers and frames take ten and a hundred times as
// long, whatever repeats in them (doc/promises.md lists the loops).
#include <logs/log.h>

#include "app/temporary_folder.h"
#include "growth.h"
#include "logs/made_logs.h"

namespace d2s1r::test
{
namespace
{
using logs::open_log;

constexpr std::int64_t kFirstTime = 1'600'000'000'000'000'000, kBetween = 10'000'000;  // [ns]

MadeScan small_scan(std::size_t i)
{
	MadeScan scan;
	scan.time = kFirstTime + kBetween * static_cast<std::int64_t>(i);
	scan.ranges.assign(3, 1.0F);
	return scan;
}

std::vector<MadeMessage> scans(Wire wire, std::size_t count)
{
	std::vector<MadeMessage> messages;
	for (std::size_t i = 0; i < count; i++) messages.push_back(made_scan(wire, small_scan(i)));
	return messages;
}

class GrowthOfLogs : public FolderTest
{
   protected:
	/// Returns the survey and the reading of a file.
	auto reading(const std::string& file, std::size_t expected) const
	{
		return [file, expected]
		{
			const logs::Log log = open_log(file);
			const auto reader = log.read();
			std::size_t found = 0;
			while (const auto object = reader->next()) found += object->scans.size();
			EXPECT_EQ(found, expected) << reader->damage();
		};
	}

	void expect_linear_in(
	    const std::string& what, std::size_t size, const std::function<std::string(std::size_t)>& file)
	{
		expect_linear(
		    what, size,
		    [&](std::size_t count)
		    {
			    write("log", file(count));
			    return reading(path("log"), count);
		    });
	}
};

TEST_F(GrowthOfLogs, WithTheNumberOfMessages)
{
	expect_linear_in("bag", 100, [](std::size_t n) { return bag1_file(scans(Wire::kRos1, n), {"", 100}); });
	expect_linear_in("chunks of a bag", 100, [](std::size_t n) { return bag1_file(scans(Wire::kRos1, n), {"", 1}); });
	expect_linear_in(
	    "chunks of a bag without an index", 100,
	    [](std::size_t n) {
		    return bag1_file(scans(Wire::kRos1, n), {"", 1, false});
	    });
#ifdef D2S1R_TF2
	expect_linear_in("MCAP", 100, [](std::size_t n) { return mcap_file(scans(Wire::kCdr, n), {"", 100}); });
	expect_linear_in("chunks of MCAP", 100, [](std::size_t n) { return mcap_file(scans(Wire::kCdr, n), {"", 1}); });
	expect_linear_in(
	    "MCAP without chunks", 100,
	    [](std::size_t n) {
		    return mcap_file(scans(Wire::kCdr, n), {"", 0, false});
	    });
#endif
}

/// All chunks overlap in time, so that their messages wait for each other.
TEST_F(GrowthOfLogs, WithTheNumberOfMessagesThatWait)
{
	expect_linear_in(
	    "chunks backwards", 100,
	    [](std::size_t n)
	    {
		    auto messages = scans(Wire::kRos1, n);
		    std::reverse(messages.begin(), messages.end());
		    return bag1_file(messages, {"", n});
	    });
}

TEST_F(GrowthOfLogs, WithTheNumberOfTopicsAndLasers)
{
	const auto of_topics = [](Wire wire, std::size_t n)
	{
		std::vector<MadeMessage> messages;
		for (std::size_t i = 0; i < n; i++)
		{
			MadeScan scan = small_scan(i);
			scan.frame = "laser" + std::to_string(i);
			messages.push_back(made_scan(wire, scan, "/scan" + std::to_string(i)));
		}
		return messages;
	};
	const auto expect = [&](const std::string& what, const auto& file_of)
	{
		expect_linear(
		    what, 20,
		    [&](std::size_t n)
		    {
			    write("log", file_of(n));
			    const std::size_t told = std::min<std::size_t>(n, 250);
			    return [file = path("log"), told] { EXPECT_EQ(open_log(file).survey.sensors.size(), told); };
		    });
	};
	// made_logs.cpp looks for the names of topics one by one, so that an MCAP file of many is long to make.
	expect("topics of a bag", [&](std::size_t n) { return bag1_file(of_topics(Wire::kRos1, n), {"", 100}); });
}

/// Each laser is compared with all odometry, which is so quick that 40,000 pairs do not stand out.
TEST_F(GrowthOfLogs, WithTheNumberOfRobots)
{
	expect_linear(
	    "robots", 2,
	    [&](std::size_t n)
	    {
		    std::vector<MadeMessage> messages;
		    for (std::size_t i = 0; i < n; i++)
		    {
			    const std::string number = std::to_string(i), robot = "/robot" + number + "/";
			    messages.push_back(made_scan(Wire::kRos1, small_scan(i), robot + "scan_of_laser_" + number));
			    messages.push_back(made_odometry(Wire::kRos1, small_scan(i).time, 0, 0, 0));
			    messages.back().topic = robot + "odometry_of_wheels_" + number;
		    }
		    write("log", bag1_file(messages, {"", 100}));
		    return [file = path("log"), n] { EXPECT_EQ(open_log(file).survey.sensors.size(), n); };
	    });
}

/// A laser that falls silent lets all lines after its last scan wait for the time of its next one.
TEST_F(GrowthOfLogs, WithTheNumberOfLinesThatWait)
{
	expect_linear_in(
	    "CARMEN log", 90,
	    [](std::size_t n)
	    {
		    std::string text;
		    for (std::size_t i = 0; i < n; i++)
			    text += std::string(i == 0 ? "RLASER" : "FLASER") + " 3 3.00 3.00 3.00 0 0 0 0 0 0 " +
			            std::to_string(static_cast<double>(i)) + " host 0.5\n";
		    return text;
	    });
}

#ifdef D2S1R_SQLITE
TEST_F(GrowthOfLogs, WithTheNumberOfMessagesOfASqliteBag)
{
	for (const bool has_index : {true, false})
		expect_linear(
		    has_index ? "sqlite" : "sqlite without an index", 50,
		    [&](std::size_t n)
		    {
			    save_sqlite_bag(path("log"), scans(Wire::kCdr, 2));
			    const std::string copies = std::to_string(n / 2 - 1);
			    alter_sqlite_bag(
			        path("log"),
			        "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < " + copies +
			            ") INSERT INTO messages(topic_id, timestamp, data) SELECT topic_id, timestamp + i * " +
			            std::to_string(2 * kBetween) + ", data FROM messages, n;");
			    if (!has_index) alter_sqlite_bag(path("log"), "DROP INDEX timestamp_idx");
			    return reading(path("log"), n);
		    });
}
#endif

TEST_F(GrowthOfLogs, WithTheNumberOfLinesOfACarmenLog)
{
	const auto lines = [](std::size_t n, const std::string& first)
	{
		std::string text;
		for (std::size_t i = 0; i < n; i++)
			text += first + "FLASER 3 1 2 3 0 0 0 0 0 0 " + std::to_string(i) + " host " + std::to_string(i) + "\n";
		return text;
	};
	expect_linear_in("lines", 100, [&](std::size_t n) { return lines(n, ""); });
	expect_linear_in("other lines", 100, [&](std::size_t n) { return lines(n, "# " + std::string(300, 'x') + "\n"); });
}
}  // namespace
}  // namespace d2s1r::test
