// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <base/errors.h>
#include <gtest/gtest.h>
#include <ros/observation.h>

#include <cmath>

#include "logs/made_logs.h"

namespace d2s1r::ros::test
{
namespace
{
using d2s1r::test::MadeCloud;
using d2s1r::test::MadeScan;
using d2s1r::test::Wire;

EncodedMessage encoded(const std::string& bytes, Wire wire)
{
	return {
	    {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()},
	    wire == Wire::kRos1 ? Encoding::kRos1 : Encoding::kCdr};
}
}  // namespace

TEST(Messages, ALaserScanHasItsFields)
{
	MadeScan made;
	made.time = 1'600'000'000'123'456'700;
	made.frame = "/laser";
	for (const Wire wire : {Wire::kRos1, Wire::kCdr, Wire::kCdr2, Wire::kBigEndian})
	{
		const std::string bytes = scan_message(wire, made);
		const LaserScan scan = decode_laser_scan(encoded(bytes, wire));
		EXPECT_EQ(scan.header.time, made.time);
		EXPECT_EQ(scan.header.frame, "laser");
		EXPECT_EQ(scan.first_angle, made.first_angle);
		EXPECT_EQ(scan.angle_step, made.angle_step);
		EXPECT_EQ(scan.max_range, made.max_range);
		EXPECT_EQ(scan.ranges, made.ranges);
		EXPECT_NEAR(middle_angle(scan), made.first_angle + made.angle_step * 3, 1e-6);
	}
}

TEST(Messages, OdometryHasItsFieldsInEveryEncoding)
{
	for (const Wire wire : {Wire::kRos1, Wire::kCdr, Wire::kCdr2, Wire::kBigEndian})
	{
		const std::string bytes = odometry_message(wire, 1'600'000'000'000'000'000, "base", 1, 2, 0.5);
		const Odometry odometry = decode_odometry(encoded(bytes, wire));
		EXPECT_EQ(odometry.pose.child, "base");
		ASSERT_TRUE(odometry.pose.pose);
		EXPECT_NEAR(odometry.pose.pose->y(), 2, 1e-12);
		EXPECT_NEAR(odometry.pose.pose->yaw(), 0.5, 1e-12);
		EXPECT_EQ(odometry.velocity.vx, 0.25);
	}
}

TEST(Messages, OtherEncodingsOfDdsAreNoDamage)
{
	std::string bytes = scan_message(Wire::kCdr, MadeScan());
	for (const char encoding : {'\x02', '\x03', '\x08', '\x0a'})
	{
		bytes[1] = encoding;
		EXPECT_THROW(decode_laser_scan(encoded(bytes, Wire::kCdr)), Unreadable) << int{encoding};
	}
}

TEST(Messages, AMultiEchoScanIsReadByItsFirstEchoes)
{
	for (const Wire wire : {Wire::kRos1, Wire::kCdr})
	{
		d2s1r::test::FieldWriter writer(wire);
		writer.header(5, "laser");
		for (const float value : {-1.0F, 1.0F, 1.0F, 0.001F, 0.1F, 0.1F, 10.0F}) writer.number(value);
		writer.number(std::uint32_t{3});
		for (const std::vector<float>& echoes : {std::vector<float>{2, 3}, {}, {4}})
		{
			writer.number(static_cast<std::uint32_t>(echoes.size()));
			for (const float echo : echoes) writer.number(echo);
		}
		writer.number(std::uint32_t{0});
		const LaserScan scan = decode_multi_echo_scan(encoded(writer.bytes(), wire));
		ASSERT_EQ(scan.ranges.size(), 3U);
		EXPECT_EQ(scan.ranges[0], 2.0F);
		EXPECT_TRUE(std::isnan(scan.ranges[1]));
		EXPECT_EQ(scan.ranges[2], 4.0F);
		EXPECT_EQ(scan.time_step, 0.001F);
	}
}

TEST(Messages, APointCloudHasItsPointsHoweverTheyAreStored)
{
	for (const Wire wire : {Wire::kRos1, Wire::kCdr, Wire::kCdr2, Wire::kBigEndian})
		for (const bool is_big_endian : {false, true})
			for (const bool are_double : {false, true})
				for (const std::uint32_t rows : {1U, 2U})
				{
					MadeCloud made;
					made.time = 7;
					made.rows = rows;
					made.row_gap = rows > 1 ? 5 : 0;
					made.is_big_endian = is_big_endian;
					made.are_double = are_double;
					made.points = {{1, 2, 3}, {-4, 5, 0.5}, {std::nan(""), 0, 0}, {7, 8, 9}};
					const std::string bytes = cloud_message(wire, made);
					const PointCloud cloud = decode_point_cloud(encoded(bytes, wire));
					EXPECT_EQ(cloud.header.frame, "laser");
					ASSERT_EQ(cloud.points.size(), 4U);
					EXPECT_EQ(cloud.points[1].x, -4.0F);
					EXPECT_EQ(cloud.points[1].z, 0.5F);
					EXPECT_TRUE(std::isnan(cloud.points[2].x));
					EXPECT_EQ(cloud.points[3].y, 8.0F);
				}
}

TEST(Messages, PointCloudsThatLieAreRefused)
{
	const auto refuse = [](const std::string& what, const auto& alter)
	{
		MadeCloud made;
		made.rows = 2;
		alter(made);
		const std::string bytes = cloud_message(Wire::kCdr, made);
		try
		{
			decode_point_cloud(encoded(bytes, Wire::kCdr));
			ADD_FAILURE() << what;
		}
		catch (const std::runtime_error& e)
		{
			EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
		}
	};
	refuse("without fields x, y and z", [](MadeCloud& cloud) { cloud.fields = {"x", "y", "intensity"}; });
	refuse("whose x is not one", [](MadeCloud& cloud) { cloud.fields = {"x", "x", "z"}; });
	refuse("whose x is not one", [](MadeCloud& cloud) { cloud.field_type = 2; });
	refuse("whose x is not one", [](MadeCloud& cloud) { cloud.field_count = 3; });
	refuse("point_step", [](MadeCloud& cloud) { cloud.point_step = 11; });
	refuse("row_step", [](MadeCloud& cloud) { cloud.point_step = 17; });
	refuse("row_step", [](MadeCloud& cloud) { cloud.point_step = 0xFFFFFFFF; });
	refuse("less data", [](MadeCloud& cloud) { cloud.missing_data = 1; });
	MadeCloud empty;
	empty.points.clear();
	EXPECT_TRUE(decode_point_cloud(encoded(cloud_message(Wire::kCdr, empty), Wire::kCdr)).points.empty());
}

TEST(Messages, ShortPointCloudsAreTold)
{
	for (const Wire wire : {Wire::kRos1, Wire::kCdr, Wire::kBigEndian})
	{
		const std::string bytes = cloud_message(wire, {});
		for (std::size_t size = 0; size + 1 < bytes.size(); size++)
		{
			const std::string cut = bytes.substr(0, size);
			EXPECT_THROW(decode_point_cloud(encoded(cut, wire)), std::runtime_error) << size;
		}
	}
}

TEST(Messages, AHeightBandOfACloudIsAScanOfALevelLaser)
{
	PointCloud cloud;
	const mrpt::poses::CPose3D sensor(0.2, 0.1, 1, 0.5, 0.3, 0);  // looks down
	const auto add = [&](double x, double y, double z)            // on the robot
	{
		const auto point = sensor.inverseComposePoint(mrpt::math::TPoint3D(x, y, z));
		cloud.points.push_back({static_cast<float>(point.x), static_cast<float>(point.y), static_cast<float>(point.z)});
	};
	add(3.2, 0.1, 0.5);   // ahead
	add(4.2, 0.1, 0.5);   // behind that
	add(2.2, 0.1, 0.01);  // the floor
	add(0.2, 2.1, 1.4);   // left
	add(0.2, -2.9, 2.5);  // the ceiling
	cloud.points.push_back({NAN, 0, 0});
	const auto [scan, sweep] = to_scan(cloud, sensor, HeightBand{0.1, 2});
	EXPECT_TRUE(sweep.is_instant());
	int valid = 0;
	for (std::size_t i = 0; i < scan.size(); i++)
	{
		if (!scan.is_valid(i)) continue;
		valid++;
		const double angle = scan.sensor_on_robot.yaw() - scan.aperture / 2.0 +
		                     static_cast<double>(i) * scan.aperture / static_cast<double>(scan.size() - 1);
		const bool is_ahead = std::abs(angle) < 1;
		EXPECT_NEAR(angle, is_ahead ? 0 : M_PI / 2, 2 * M_PI / 1440);
		EXPECT_NEAR(scan.ranges[i], is_ahead ? 3 : 2, 1e-5);
	}
	EXPECT_EQ(valid, 2);
	EXPECT_NEAR(scan.sensor_on_robot.pitch(), 0, 1e-9);
	EXPECT_NEAR(scan.sensor_on_robot.z(), 1, 1e-9);
}

TEST(Messages, PointsHaveTheirTimesInTheUnitsOfDrivers)
{
	struct Driver
	{
		const char* field;
		std::uint8_t type;
		double early, late;  // 0.02 and 0.05 s after the message
	};
	for (const Driver& driver :
	     {Driver{"t", 6, 2e7, 5e7}, Driver{"time", 7, 0.02, 0.05}, Driver{"offset_time", 8, 0.02, 0.05},
	      Driver{"timestamp", 8, 1600000000.02, 1600000000.05},
	      Driver{"timestamp", 8, 1.60000000002e18, 1.60000000005e18},
	      Driver{"timestamp", 8, 1.60000000002e15, 1.60000000005e15}, Driver{"t", 6, 2e4, 5e4}, Driver{"t", 6, 20, 50},
	      Driver{"time", 7, 2e7, 5e7}, Driver{"time", 7, 2e4, 5e4}, Driver{"time", 7, 20, 50},
	      Driver{"offset_time", 8, 2e7, 5e7}, Driver{"ring", 7, 0, 0}})
		for (const bool is_big_endian : {false, true})
		{
			MadeCloud made;
			made.time = 1'600'000'000'000'000'000;
			made.is_big_endian = is_big_endian;
			made.time_field = driver.field;
			made.time_type = driver.type;
			made.times = {driver.early, driver.late};
			const auto cloud = decode_point_cloud(encoded(cloud_message(Wire::kCdr, made), Wire::kCdr));
			const bool is_time = driver.late > 0;
			EXPECT_NEAR(cloud.points.at(0).time, is_time ? 0.02 : 0, 1e-6) << driver.field << int{driver.type};
			EXPECT_NEAR(cloud.points.at(1).time, is_time ? 0.05 : 0, 1e-6) << driver.field << int{driver.type};
			EXPECT_EQ(cloud.points.at(1).y, 5);
			EXPECT_NEAR(time_span_of(cloud).duration, is_time ? 0.03 : 0, 1e-6);
		}
}

TEST(Messages, ACloudOfASpinningLaserIsSwept)
{
	constexpr double kTurn = 0.1, kBegin = 2.0, kDelay = 0.03;  // [s], [rad], [s]
	for (const int direction : {1, -1})
		for (const bool is_scattered : {false, true})
		{
			PointCloud cloud;
			for (int i = 0; i < 900; i++)
			{
				const double share = i / 900.0, angle = kBegin + direction * 2 * M_PI * share;
				const double time = is_scattered ? kTurn * std::fmod(0.618 * i, 1) : kDelay + kTurn * share;
				const double range = 2 + share;
				for (const double height : {-0.05, 0.05})  // two rings, which do not fire in the same direction
					cloud.points.push_back(
					    {static_cast<float>(range * std::cos(angle + height)),
					     static_cast<float>(range * std::sin(angle + height)), static_cast<float>(height),
					     static_cast<float>(time)});
			}
			const mrpt::poses::CPose3D sensor(0.2, 0, 1, 0.7, 0, 0);
			const auto [scan, sweep] = to_scan(cloud, sensor, HeightBand{0.5, 2});
			EXPECT_EQ(sweep.is_instant(), is_scattered);
			if (is_scattered) continue;
			EXPECT_NEAR(sweep.duration, kTurn, 0.002);
			EXPECT_EQ(scan.right_to_left, direction > 0);
			const auto beams = static_cast<double>(scan.size());
			const double aperture = static_cast<double>(scan.aperture);
			int checked = 0;
			for (std::size_t i = 100; i + 100 < scan.size(); i++)
			{
				if (!scan.is_valid(i)) continue;
				const double share = static_cast<double>(scan.ranges[i]) - 2;
				const double along = static_cast<double>(i) / (beams - 1);
				EXPECT_NEAR(sweep.first_beam + sweep.duration * along, kDelay + kTurn * share, 0.002);
				const double angle = scan.sensor_on_robot.yaw() + direction * (along - 0.5) * aperture;
				EXPECT_NEAR(std::remainder(angle - 0.7 - kBegin - direction * 2 * M_PI * share, 2 * M_PI), 0, 0.06);
				checked++;
			}
			EXPECT_GT(checked, 500);
		}
}

TEST(Messages, ShortMessagesAreTold)
{
	for (const Wire wire : {Wire::kRos1, Wire::kCdr, Wire::kCdr2, Wire::kBigEndian})
	{
		const std::string bytes = scan_message(wire, MadeScan());
		constexpr std::size_t kIntensities = 4;  // [byte] at the end, which nobody reads
		for (std::size_t size = 0; size < bytes.size() - kIntensities; size++)
		{
			const std::string cut = bytes.substr(0, size);
			EXPECT_THROW(decode_laser_scan(encoded(cut, wire)), std::runtime_error) << size;
		}
	}
}

TEST(Messages, TimesBecomeThoseOfMrptTo100Nanoseconds)
{
	const auto base = mrpt::Clock::fromDouble(0);
	EXPECT_EQ(to_time(0), base);
	EXPECT_EQ((to_time(1'600'000'000'123'456'789) - base).count(), 16'000'000'001'234'567);
}
}  // namespace d2s1r::ros::test
