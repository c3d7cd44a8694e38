// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A log is known by its content, whatever its name.
#include <logs/errors.h>
#include <logs/log.h>
#include <logs/mrpt_objects.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/temporary_folder.h"
#include "logs/made_logs.h"

using namespace d2s1r::test;
using namespace d2s1r::logs;

namespace
{
constexpr std::int64_t kTime = 1'600'000'000'000'000'000;  // [ns]

MadeScan some_scan()
{
	MadeScan scan;
	scan.time = 1'000'000'000;
	return scan;
}
}  // namespace

class LogFiles : public FolderTest
{
   protected:
	std::string format_of(const std::string& content) const
	{
		write("log", content);
		return open_log(path("log")).survey.format;
	}

	std::string refusal(const std::string& content) const
	{
		write("log", content);
		try
		{
			open_log(path("log"));
		}
		catch (const LogError& e)
		{
			return std::string(e.what()).substr(path("log").size() + 2);
		}
		return "";
	}

	static std::string rawlog()
	{
		mrpt::obs::CObservation2DRangeScan scan;
		scan.sensorLabel = "LASER";
		const auto bytes =
		    to_bytes(object_of(recorded_scan(std::make_shared<mrpt::obs::CObservation2DRangeScan>(scan))));
		return {bytes.begin(), bytes.end()};
	}
};

TEST_F(LogFiles, AreKnownByTheirContent)
{
	EXPECT_EQ(format_of(rawlog()), "MRPT rawlog");
	EXPECT_EQ(format_of(bag1_file({made_scan(Wire::kRos1, some_scan())})), "ROS 1 bag");
	EXPECT_EQ(format_of("# CARMEN Logfile\nODOM 0 0 0 0 0 0 1 h 1\n"), "CARMEN log");
	EXPECT_EQ(format_of(mcap_file({made_scan(Wire::kRos1, some_scan())}, {}, "ros1")), "MCAP file");
#ifdef D2S1R_SQLITE
	save_sqlite_bag(path("sqlite"), {made_scan(Wire::kCdr, some_scan())});
	EXPECT_EQ(open_log(path("sqlite")).survey.format, "ROS 2 bag");
	write("metadata.yaml", "rosbag2_bagfile_information:\n  relative_file_paths: [sqlite]\n");
	EXPECT_EQ(open_log(path("")).survey.format, "ROS 2 bag");
#endif
}

TEST_F(LogFiles, WhatIsNoneIsRefusedInOneLine)
{
	for (const std::string& content :
	     {std::string("hello\nworld\n"), std::string(5000, '\xff'), std::string("\x80"), std::string("PK\3\4zip")})
	{
		const std::string line = refusal(content);
		EXPECT_FALSE(line.empty());
		EXPECT_EQ(line.find('\n'), std::string::npos);
	}
	EXPECT_EQ(refusal("hello\n").rfind("not a log that I know (MRPT rawlogs, CARMEN logs, ROS 1 bags", 0), 0U);
	EXPECT_EQ(refusal("").rfind("is empty", 0), 0U);
	EXPECT_THROW(open_log(path("")), LogError);  // a folder without metadata.yaml
	EXPECT_THROW(open_log(path("missing")), LogError);
	EXPECT_THROW(open_log("/dev/null"), LogError);
}

TEST_F(LogFiles, SensorPoseReplacesThatOfTheLog)
{
	MadeScan scan = some_scan();
	scan.first_angle = 0;  // its middle is at 1.5 rad
	write("log", bag1_file({made_scan(Wire::kRos1, scan), made_scan(Wire::kRos1, scan, "/other")}));
	Overrides overrides;
	overrides.sensor_pose = mrpt::poses::CPose3D(0.5, 0, 0, 0.25, 0, 0);
	const auto reader = read_log(open_log(path("log")), "/scan", overrides);
	const auto object = reader->next().value(), other = reader->next().value();
	EXPECT_NEAR(object.scans.at(0)->sensor_on_robot.x(), 0.5, 1e-9);
	EXPECT_NEAR(object.scans.at(0)->sensor_on_robot.yaw(), 1.75, 1e-6);
	EXPECT_NEAR(other.scans.at(0)->sensor_on_robot.x(), 0, 1e-9);
}

TEST_F(LogFiles, MaxRangeReplacesThatOfTheLog)
{
	MadeScan scan = some_scan();
	scan.max_range = 4;
	write("log", bag1_file({made_scan(Wire::kRos1, scan)}));
	const auto validity = [&](float max_range)
	{
		Overrides overrides;
		overrides.max_range = max_range;
		const auto object = read_log(open_log(path("log")), "/scan", overrides)->next().value();
		EXPECT_EQ(object.scans.at(0)->max_range, max_range);
		std::string valid;
		for (std::size_t i = 0; i < 7; i++) valid += object.scans.at(0)->is_valid(i) ? '1' : '0';
		return valid;
	};
	EXPECT_EQ(validity(6.5F), "1111110");  // readings of 1 m to 7 m
	EXPECT_EQ(validity(100), "1111111");
}

TEST(LogTime, IsExactTo100NanosecondsWhateverMrptRoundsTo)
{
	EXPECT_EQ(to_seconds(from_seconds(1'600'000'000.1234567)), 1'600'000'000.1234567);
	for (const double seconds : {-1.5, 1e-7, 0.3, 123.4, 1'600'000'000.4})
		EXPECT_EQ(to_seconds(from_seconds(seconds)), seconds);
	EXPECT_EQ(to_seconds(INVALID_TIMESTAMP), 0);
}

TEST(LogTime, OfADamagedLogIsSomeNumber)
{
	using Limits = std::numeric_limits<mrpt::Clock::rep>;
	for (const auto ticks : {Limits::min(), Limits::max()})
		EXPECT_TRUE(std::isfinite(to_seconds(mrpt::Clock::time_point(mrpt::Clock::duration(ticks)))));
	EXPECT_EQ(to_seconds(from_seconds(1e300)), 1e11);
	EXPECT_EQ(to_seconds(from_seconds(-1e300)), -1e10);
}

/// Logs of every format with the name of each.
TEST_F(LogFiles, RecordingsThatWerePackedAsAWholeSayHowToUnpackThem)
{
	const std::string bag = bag1_file({made_scan(Wire::kRos1, some_scan())});
	if (can_pack("zstd"))
	{
		EXPECT_NE(refusal(packed("zstd", bag)).find("unpack it by 'zstd -d'"), std::string::npos);
	}
	if (can_pack("bz2"))
	{
		EXPECT_NE(refusal(packed("bz2", bag)).find("unpack it by 'bunzip2'"), std::string::npos);
	}
	mrpt::io::CFileGZOutputStream stream(path("packed.gz"));
	stream.Write(bag.data(), bag.size());
	stream.close();
	EXPECT_NE(refusal(read("packed.gz")).find("unpack it by 'gunzip'"), std::string::npos);
}

TEST_F(LogFiles, AScanHasTheOdometryDuringItsBeams)
{
	std::vector<MadeMessage> messages;
	for (int i = 0; i < 40; i++)
	{
		const std::int64_t time = kTime + i * 50'000'000;  // every 0.05 s, recorded 0.02 s later
		messages.push_back(made_odometry(Wire::kRos1, time, 0.1 * i, 0, 0));
		messages.back().time += 20'000'000;
		MadeScan scan = some_scan();
		scan.time = time + 10'000'000;
		scan.time_step = 0.11F / static_cast<float>(scan.ranges.size() - 1);
		messages.push_back(made_scan(Wire::kRos1, scan));
	}
	std::sort(messages.begin(), messages.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
	write("log", bag1_file(messages));
	const Log log = open_log(path("log"));
	const auto reader = read_log(log, "/scan", {});
	std::size_t scans = 0;
	while (const auto object = reader->next())
	{
		if (object->scans.empty()) continue;
		constexpr double kStart = 0, kEnd = 0.11;  // [s] after the time of the scan
		const auto& odometry = object->details.at(0).motion.motion;
		if (scans++ >= 37) continue;  // the log ends during these
		if (scans == 1) continue;     // there is no odometry before it but one
		ASSERT_EQ(odometry.size(), 5U) << scans;
		EXPECT_LE(odometry[1].time, kStart);
		EXPECT_GT(odometry[2].time, kStart);
		EXPECT_LT(odometry[3].time, kEnd);
		EXPECT_GE(odometry[4].time, kEnd);
	}
	EXPECT_EQ(scans, 40U);
}

TEST_F(LogFiles, TheTimeOfASweepCanBeGiven)
{
	write("log", bag1_file({made_scan(Wire::kRos1, some_scan())}));
	Overrides overrides;
	overrides.sweep = SweepTime{-0.1, 0.05};
	const auto object = read_log(open_log(path("log")), "/scan", overrides)->next();
	ASSERT_TRUE(object);
	EXPECT_EQ(object->details.at(0).sweep.duration, -0.1);
	EXPECT_EQ(object->details.at(0).sweep.first_beam, 0.05);

	Overrides of_others;
	of_others.of_others["/scan"].sweep = SweepTime{0.2, 0};
	const auto other = read_log(open_log(path("log")), "/front", of_others)->next();
	ASSERT_TRUE(other);
	EXPECT_EQ(other->details.at(0).sweep.duration, 0.2);
}

TEST_F(LogFiles, AScanHasTheMotionThatActionCollectionsTell)
{
	std::string bytes;
	for (int i = 0; i < 5; i++)
	{
		mrpt::obs::CActionRobotMovement2D motion;
		motion.computeFromOdometry(mrpt::poses::CPose2D(0.5, 0, 0), {});
		mrpt::obs::CActionCollection actions;
		actions.insert(motion);
		mrpt::obs::CSensoryFrame frame;
		auto scan = std::make_shared<mrpt::obs::CObservation2DRangeScan>();
		scan->sensorLabel = "LASER";
		scan->timestamp = from_seconds(1000 + 0.1 * i);
		scan->resizeScan(10);
		frame.insert(scan);
		for (const mrpt::serialization::CSerializable* object :
		     {static_cast<const mrpt::serialization::CSerializable*>(&actions),
		      static_cast<const mrpt::serialization::CSerializable*>(&frame)})
		{
			std::vector<std::uint8_t> part;
			mrpt::serialization::ObjectToOctetVector(object, part);
			bytes.append(part.begin(), part.end());
		}
	}
	write("log", bytes);
	Overrides overrides;
	overrides.sweep = SweepTime{0.1, 0};
	const auto reader = read_log(open_log(path("log")), "LASER", overrides);
	std::vector<ScanDetails> details;
	while (const auto object = reader->next())
		details.insert(details.end(), object->details.begin(), object->details.end());
	ASSERT_EQ(details.size(), 5U);
	ASSERT_GE(details[2].motion.motion.size(), 3U);
	for (std::size_t i = 1; i < details[2].motion.motion.size(); i++)
	{
		EXPECT_NEAR(details[2].motion.motion[i].time - details[2].motion.motion[i - 1].time, 0.1, 1e-6);
		EXPECT_NEAR(details[2].motion.motion[i].robot.x - details[2].motion.motion[i - 1].robot.x, 0.5, 1e-9);
	}
}

class LogFilesThatAreStopped : public LogFiles
{
   protected:
	LogFilesThatAreStopped()
	{
		write("rawlog", rawlog() + rawlog() + rawlog());
		write("carmen", "# CARMEN Logfile\nODOM 0 0 0 0 0 0 1 h 1\n");
		const std::vector<MadeMessage> ros1(3, made_scan(Wire::kRos1, some_scan()));
		write("bag", bag1_file(ros1));
		write("bag without an index", bag1_file(ros1, {"", 1, false}));
		write("mcap", mcap_file(ros1, {"", 1}, "ros1"));
		write("mcap without chunks", mcap_file(ros1, {"", 0}, "ros1"));
		names_ = {"rawlog", "carmen", "bag", "bag without an index", "mcap", "mcap without chunks"};
#ifdef D2S1R_SQLITE
		save_sqlite_bag(path("sqlite"), std::vector<MadeMessage>(3, made_scan(Wire::kCdr, some_scan())));
		write("metadata.yaml", "rosbag2_bagfile_information:\n  relative_file_paths: [sqlite]\n");
		names_.insert(names_.end(), {"sqlite", ""});
#endif
	}

	std::vector<std::string> names_;
};

TEST_F(LogFilesThatAreStopped, EndTheirSurvey)
{
	for (const std::string& name : names_)
		for (const int before : {0, 1})
		{
			int asked = 0;
			EXPECT_THROW(open_log(path(name), [&] { return asked++ >= before; }), Interrupted) << name << " " << before;
		}
}

TEST_F(LogFilesThatAreStopped, EndTheirReadingWithoutDamage)
{
	for (const std::string& name : names_)
	{
		if (name == "rawlog") continue;  // its reader takes no time between objects
		bool is_stopped = false;
		const Log log = open_log(path(name), [&] { return is_stopped; });
		const auto reader = log.read();
		is_stopped = true;
		EXPECT_FALSE(reader->next()) << name;
		EXPECT_EQ(reader->damage(), "") << name;
	}
}

#if defined(D2S1R_SQLITE)
TEST_F(LogFilesThatAreStopped, EndTheSortingOfABagWithoutAnIndex)
{
	save_sqlite_bag(path("long"), {made_scan(Wire::kCdr, some_scan())});
	alter_sqlite_bag(
	    path("long"),
	    "DROP INDEX timestamp_idx; WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < 20000) "
	    "INSERT INTO messages(topic_id, timestamp, data) SELECT topic_id, timestamp - i, data FROM messages, n;");
	int asked = 0;
	EXPECT_THROW(open_log(path("long"), [&] { return asked++ >= 5; }), Interrupted);
}
#endif
