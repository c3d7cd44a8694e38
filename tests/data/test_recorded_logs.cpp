// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Logs of real robots, in every format that is read.
#include <d2s1r/localizer.h>
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>

#include <cmath>
#include <fstream>
#include <map>

#include "input/inputs.h"
#include "sites.h"

namespace d2s1r::test
{
namespace
{
namespace fs = std::filesystem;
using logs::Log;

fs::path log_files()
{
	return sites_folder() / "logs";
}

/// A log and what is in it, or why it is refused.
struct ExpectedLog
{
	const char* file;
	const char* laser = "";
	std::size_t scans = 0;
	const char* mounting = "";  //!< a part of Sensor::mounting
	const char* odometry = "";
	const char* refusal = "";  //!< a part of the error
};

std::ostream& operator<<(std::ostream& stream, const ExpectedLog& expected)
{
	return stream << expected.file;
}

/// Opens a log, chooses its laser and reads it to its end. \returns what the error says, empty if there was none
std::string read_to_end(const fs::path& file, logs::LogSurvey& survey, logs::Sensor& sensor)
{
	try
	{
		const Log log = logs::open_log(file);
		survey = log.survey;
		app::LogRequest request;
		request.file = file;
		sensor = app::choose_sensor(survey, request);
		const auto reader = log.read();
		std::size_t scans = 0;
		while (const auto object = reader->next())
			for (const auto& scan : object->scans) scans += scan->label == sensor.label ? 1 : 0;
		EXPECT_EQ(scans, sensor.scans);
		return reader->damage();
	}
	catch (const std::runtime_error& error)
	{
		return error.what();
	}
}

/// Bytes of all objects of a log.
std::vector<std::vector<std::uint8_t>> bytes_of(const fs::path& file)
{
	std::vector<std::vector<std::uint8_t>> bytes;
	const auto reader = logs::open_log(file).read();
	while (auto object = reader->next()) bytes.push_back(std::move(object->bytes));
	EXPECT_EQ(reader->damage(), "");
	return bytes;
}
}  // namespace

class RecordedLogs : public testing::TestWithParam<ExpectedLog>
{
};

TEST_P(RecordedLogs, AreReadOrRefused)
{
	const ExpectedLog& expected = GetParam();
	const fs::path file = log_files() / expected.file;
	if (!fs::exists(file)) GTEST_SKIP() << why_skipped(file);
	logs::LogSurvey survey;
	logs::Sensor sensor;
	const std::string error = read_to_end(file, survey, sensor);
	if (*expected.refusal != '\0')
	{
		EXPECT_NE(error.find(expected.refusal), std::string::npos) << error;
		return;
	}
	EXPECT_EQ(error, "");
	EXPECT_EQ(survey.damage, "");
	EXPECT_EQ(sensor.label, expected.laser);
	EXPECT_EQ(sensor.scans, expected.scans);
	EXPECT_NE(sensor.mounting.find(expected.mounting), std::string::npos) << sensor.mounting;
	EXPECT_EQ(survey.odometry, expected.odometry);
}

constexpr const char* kUnknown = "of unknown pose on the robot";
constexpr const char* kNoScan = "holds no 2D laser scan (sensor_msgs/LaserScan)";
constexpr const char* kOnTurtleBot = "at x 0.004, y 0.000, z 0.139 m, yaw 90.0, pitch 0.0, roll 0.0 deg on base_link";
constexpr const char* kOnPioneer = "at x 0.135, y 0.000, z 0.202 m, yaw 0.0, pitch 0.0, roll 0.0 deg on base_link";

INSTANTIATE_TEST_SUITE_P(
    All, RecordedLogs,
    testing::Values(
        ExpectedLog{"ros2_db3_olin_mac/macfirst_floor_take_2", "/scan", 357, kOnTurtleBot, "/odom"},
        ExpectedLog{"derived/mac_take_2_mcap_zstd", "/scan", 357, kOnTurtleBot, "/odom"},
        ExpectedLog{"ros2_db3_mumble/straight", "/scan", 147, kUnknown},
        ExpectedLog{"ros2_db3_mumble/straight/mumble_imu_lidar_bag_0.db3", "/scan", 147, kUnknown},
        ExpectedLog{"mcap_rosbag2_tests/wbag", "", 0, "", "", kNoScan},
        ExpectedLog{"mcap_rosbag2_tests/rewriter_b", "", 0, "", "", kNoScan},
        ExpectedLog{"ros1_uob_pioneer/trace0.bag", "/base_scan", 958, kOnPioneer, "/odom"},
        ExpectedLog{"ros1_two_lasers/scans_demo.bag", "/front_scan", 331, kUnknown},
        ExpectedLog{"ros1_ccny_handheld/demo.bag", "/scan", 360, kUnknown},
        ExpectedLog{"ros1_ccny_handheld/demo_v1.2.bag", "", 0, "", "", "is a ROS bag of version V1.2"},
        ExpectedLog{"ros1_bz2_lz4_no_laser/example.bag", "", 0, "", "", kNoScan},
        ExpectedLog{"ros1_bz2_lz4_no_laser/example-bz2.bag", "", 0, "", "", kNoScan},
        ExpectedLog{"ros1_bz2_lz4_no_laser/example-lz4.bag", "", 0, "", "", kNoScan},
        ExpectedLog{"ros1_bz2_lz4_no_laser/example-unsorted-chunks.bag", "", 0, "", "", kNoScan},
        ExpectedLog{"ros1_bz2_lz4_no_laser/no-messages.bag", "", 0, "", "", kNoScan},
        ExpectedLog{"ros1_bz2_lz4_no_laser/empty-file.bag", "", 0, "", "", "is empty"},
        ExpectedLog{"carmen_radish/intel.clf.bz2", "FLASER", 13631, "", "the log"},
        ExpectedLog{"carmen_radish/fr079.clf.bz2", "FLASER", 4934, "", "the log"},
        ExpectedLog{"carmen_radish/mit-csail.clf.bz2", "FLASER", 1988, "", "the log"},
        ExpectedLog{"carmen_radish/LICENSE", "", 0, "", "", "not a log that I know ("}));

TEST(RecordedLogs, AreTheSameWhateverThePacking)
{
	const auto expect_same = [](const fs::path& first, const std::vector<std::string>& others)
	{
		if (!fs::exists(first)) GTEST_SKIP() << why_skipped(first);
		const auto bytes = bytes_of(first);
		EXPECT_GT(bytes.size(), 1000U);
		for (const std::string& other : others)
			EXPECT_TRUE(bytes_of(log_files() / "derived" / other) == bytes) << other;
	};
	expect_same(
	    log_files() / "ros2_db3_olin_mac/macfirst_floor_take_2",
	    {"mac_take_2_mcap_zstd", "mac_take_2_mcap_lz4", "mac_take_2_mcap_none", "mac_take_2_mcap_unchunked"});
	expect_same(log_files() / "ros1_uob_pioneer/trace0.bag", {"trace0_bz2.bag", "trace0_lz4.bag"});
}

TEST(RecordedLogs, TimesOfTheIntelLogAreRepairedAndIncrease)
{
	const fs::path file = log_files() / "carmen_radish/intel.clf.bz2";
	if (!fs::exists(file)) GTEST_SKIP() << why_skipped(file);
	const Log log = logs::open_log(file);
	ASSERT_EQ(log.survey.notes.size(), 1U);
	EXPECT_NE(log.survey.notes[0].find(" of 13631 scans have a time that is out of line"), std::string::npos);
	EXPECT_LT(std::stoi(log.survey.notes[0]), 1000);  // 631 run back
	mrpt::Clock::time_point last{};
	const auto reader = log.read();
	while (const auto object = reader->next())
		for (const auto& scan : object->scans)
		{
			EXPECT_GT(scan->timestamp, last);
			last = scan->timestamp;
		}
}

/// A map, and poses of the laser in it by the times of the scans.
class TurtleBotLog : public testing::TestWithParam<std::pair<const char*, const char*>>
{
};

TEST_P(TurtleBotLog, IsLocalizedWhereTheLaserWas)
{
	const auto [map, truth] = GetParam();
	const fs::path folder = log_files() / "ros2_db3_olin_mac";
	if (!fs::exists(folder)) GTEST_SKIP() << why_skipped(folder);
	const Localizer localizer(load_map((sites_folder() / map / "map.yaml").string()), Parameters{});
	std::ifstream lines(folder / truth);
	std::map<std::int64_t, mrpt::math::TPose2D> poses;  // laser in map, by [0.1 ms]
	for (std::string line; std::getline(lines, line);)
	{
		double time = 0, x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 0;
		std::istringstream values(line);
		if (values >> time >> x >> y >> z >> qx >> qy >> qz >> qw)
			poses[std::llround(time * 1e4)] = {x, y, 2 * std::atan2(qz, qw)};
	}
	const auto reader = logs::open_log(folder / "macfirst_floor_take_2").read();
	std::size_t compared = 0, localized = 0;
	while (const auto object = reader->next())
		for (const auto& scan : object->scans)
		{
			const std::int64_t time = std::llround(logs::to_seconds(scan->timestamp) * 1e4);
			const auto pose = poses.lower_bound(time - 5);
			if (pose == poses.end() || pose->first > time + 5) continue;
			const Localization result = localizer.localize(*scan);
			ASSERT_FALSE(result.hypotheses.empty());
			localized += result.status == Status::kLocalized ? 1 : 0;
			// The scans are of a full turn from -pi on, so that their middle is the x axis of the laser.
			const auto laser = (result.best().pose + mrpt::poses::CPose2D(scan->sensor_on_robot)).asTPose();
			EXPECT_LT(std::hypot(laser.x - pose->second.x, laser.y - pose->second.y), 0.3);
			EXPECT_LT(std::abs(mrpt::math::wrapToPi(laser.phi - pose->second.phi)), mrpt::DEG2RAD(5.0));
			compared++;
		}
	EXPECT_EQ(compared, 96U);
	EXPECT_GE(localized, 95U) << "at the right pose, one scan may have a confidence a little below 0.9";
}

INSTANTIATE_TEST_SUITE_P(
    Maps, TurtleBotLog,
    testing::Values(
        std::pair("olin_mac_923", "laser_in_mac_1st_floor_9_23.tum"),
        std::pair("olin_mac_final", "laser_in_mac_1st_floor_final.tum")));
}  // namespace d2s1r::test
