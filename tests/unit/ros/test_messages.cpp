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
