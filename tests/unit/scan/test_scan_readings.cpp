// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What drivers and logs write for a range, and what of it a scan takes over.
#include <d2s1r/scan.h>
#include <gtest/gtest.h>

#include <limits>

#include "recorded_scan.h"

namespace d2s1r::test
{
namespace
{
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
}  // namespace

TEST(ScanReadings, BeyondTheMaximumRangeIsInformationFlaggedOrNot)
{
	for (const bool flagged_valid : {true, false})
		for (const float range : {10.0F, 81.9F, kInf})
		{
			auto observation = record({5, range, 5});
			observation.setScanRangeValidity(1, flagged_valid);
			const Scan scan = make_scan(observation, few_beams());
			ASSERT_EQ(scan.beams.size(), 3U) << range;
			EXPECT_FALSE(scan.beams[1].is_return) << range;
			EXPECT_FLOAT_EQ(scan.beams[1].range, 10) << range;
			EXPECT_TRUE(scan.beams[0].is_return);
		}
}

TEST(ScanReadings, WhatIsNoDataIsLeftOut)
{
	for (const float range : {kNan, -kInf, -1.0F, 0.0F})
		for (const bool flagged_valid : {true, false})
		{
			auto observation = record({5, range, 5});
			observation.setScanRangeValidity(1, flagged_valid);
			EXPECT_EQ(make_scan(observation, few_beams()).beams.size(), 2U) << range << flagged_valid;
		}
	auto excluded = record({5, 4, 5});
	excluded.setScanRangeValidity(1, false);
	EXPECT_EQ(make_scan(excluded, few_beams()).beams.size(), 2U);
}

TEST(ScanReadings, ZeroIsNoReturnIfSaidSo)
{
	ScanParameters parameters = few_beams();
	parameters.zero_is_no_return = true;
	auto observation = record({5, 0, 5});
	observation.setScanRangeValidity(1, false);
	const Scan scan = make_scan(observation, parameters);
	ASSERT_EQ(scan.beams.size(), 3U);
	EXPECT_FALSE(scan.beams[1].is_return);
	EXPECT_FLOAT_EQ(scan.beams[1].range, 10);
}

TEST(ScanReadings, TooLittleToGoByIsInvalidWithAReason)
{
	EXPECT_EQ(make_scan(record({1, 2, 3}), {}).invalid_because, "fewer usable beams than scan.min_beams");
	EXPECT_EQ(make_scan(record({kInf, kInf}), few_beams()).invalid_because, "no beam hit anything");
	EXPECT_NE(make_scan(record({1}), few_beams()).invalid_because.find("fewer than 2"), std::string::npos);
	EXPECT_NE(make_scan(record({}), few_beams()).invalid_because.find("fewer than 2"), std::string::npos);
}

TEST(ScanReadings, AsManyBeamsAsAskedForAreEnough)
{
	ScanParameters parameters;
	parameters.min_beams = 3;
	EXPECT_TRUE(make_scan(record({1, 2, 3}), parameters).valid());
	EXPECT_FALSE(make_scan(record({1, 2, kNan}), parameters).valid());
}

TEST(ScanReadings, MalformedObservationsAreInvalidWithAReason)
{
	auto observation = record({1, 2, 3});
	observation.aperture = 0;
	EXPECT_NE(make_scan(observation, few_beams()).invalid_because.find("aperture"), std::string::npos);
	observation = record({1, 2, 3});
	observation.maxRange = kNan;
	EXPECT_NE(make_scan(observation, few_beams()).invalid_because.find("maxRange"), std::string::npos);
	observation = record({1, 2, 3});
	observation.sensorPose.x(std::numeric_limits<double>::quiet_NaN());
	EXPECT_NE(make_scan(observation, few_beams()).invalid_because.find("pose of the sensor"), std::string::npos);
}
}  // namespace d2s1r::test
