// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What drivers and logs write for a range, and what of it a scan takes over.
#include <d2s1r/scan.h>
#include <d2s1r/scan_defect.h>
#include <gtest/gtest.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

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
			observation.valid[1] = flagged_valid;
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
			observation.valid[1] = flagged_valid;
			EXPECT_EQ(make_scan(observation, few_beams()).beams.size(), 2U) << range << flagged_valid;
		}
	auto excluded = record({5, 4, 5});
	excluded.valid[1] = false;
	EXPECT_EQ(make_scan(excluded, few_beams()).beams.size(), 2U);
}

TEST(ScanReadings, ZeroIsNoReturnIfSaidSo)
{
	ScanParameters parameters = few_beams();
	parameters.zero_is_no_return = true;
	auto observation = record({5, 0, 5});
	observation.valid[1] = false;
	const Scan scan = make_scan(observation, parameters);
	ASSERT_EQ(scan.beams.size(), 3U);
	EXPECT_FALSE(scan.beams[1].is_return);
	EXPECT_FLOAT_EQ(scan.beams[1].range, 10);
}

TEST(ScanReadings, TooLittleToGoByIsInvalidWithAReason)
{
	EXPECT_EQ(make_scan(record({1, 2, 3}), {}).invalid_because, "fewer usable beams than scan.min_beams");
	EXPECT_EQ(make_scan(record({kInf, kInf}), few_beams()).invalid_because, "no beam hit anything");
	EXPECT_EQ(defect_of(record({1, 2, 3}), {}, {}), ScanDefect::kFewBeams);
	EXPECT_EQ(defect_of(record({kInf, kInf}), few_beams(), {}), ScanDefect::kNoReturns);
	EXPECT_EQ(defect_of(record({1}), few_beams(), {}), ScanDefect::kOther);
	EXPECT_EQ(defect_of(record({1, 2, 3}), few_beams(), {}), ScanDefect::kNone);
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
	EXPECT_EQ(defect_of(observation, few_beams(), {}), ScanDefect::kAngles);
	observation = record({1, 2, 3});
	observation.max_range = kNan;
	EXPECT_NE(make_scan(observation, few_beams()).invalid_because.find("maxRange"), std::string::npos);
	EXPECT_EQ(defect_of(observation, few_beams(), {}), ScanDefect::kMaxRange);
	observation = record({1, 2, 3});
	observation.sensor_on_robot.x(std::numeric_limits<double>::quiet_NaN());
	EXPECT_NE(make_scan(observation, few_beams()).invalid_because.find("pose of the sensor"), std::string::npos);
	EXPECT_EQ(defect_of(observation, few_beams(), {}), ScanDefect::kSensorPose);
}

namespace
{
/// Ranges [m] of 180 beams of half a turn in a room, at most so far as its walls, rounded to `step` [m] if it is above
/// 0.
std::vector<float> room(float step = 0)
{
	std::vector<float> ranges;
	for (int i = 0; i < 180; i++)
	{
		const double angle = mrpt::DEG2RAD(static_cast<double>(i) + 0.37);
		const double to_side = 2.1 / std::abs(std::cos(angle)), to_front = 3.3 / std::abs(std::sin(angle));
		const auto range = static_cast<float>(std::min(to_side, to_front));
		ranges.push_back(step > 0 ? step * std::round(range / step) : range);
	}
	return ranges;
}

/// Gives a share of the ranges, at random, another value.
std::vector<float> spoiled(std::vector<float> ranges, double share, float value, unsigned seed = 1)
{
	std::mt19937 generator(seed);
	std::bernoulli_distribution is_spoiled(share);
	for (float& range : ranges)
		if (is_spoiled(generator)) range = value;
	return ranges;
}

Scan scan_of(const std::vector<float>& ranges, double no_return = ScanParameters().no_return)
{
	ScanParameters parameters;
	parameters.no_return = no_return;
	return make_scan(record(ranges), parameters);
}
}  // namespace

TEST(ScanReadings, ARangeThatManyBeamsShareIsNoData)
{
	for (const double share : {0.15, 0.3, 0.5, 0.7})
		for (const float value : {0.2F, 0.5F, 1.0F, 8.0F})
			for (const unsigned seed : {1U, 2U, 3U})
			{
				const auto ranges = spoiled(room(), share, value, seed);
				const Scan scan = scan_of(ranges);
				const auto is_value = [&](const Beam& beam) { return beam.range == value; };
				EXPECT_EQ(std::count_if(scan.beams.begin(), scan.beams.end(), is_value), 0) << share << ' ' << value;
				EXPECT_EQ(scan.repeated, static_cast<std::size_t>(std::count(ranges.begin(), ranges.end(), value)));
				EXPECT_EQ(scan.beams.size() + scan.repeated, ranges.size());
			}
	// Two such values, too.
	EXPECT_GT(scan_of(spoiled(spoiled(room(), 0.3, 0.4F, 1), 0.3, 0.7F, 2)).repeated, 70U);
}

TEST(ScanReadings, WallsOfRoundedRangesAreData)
{
	for (const float step : {0.0F, 0.01F, 0.05F, 0.1F, 0.25F}) EXPECT_EQ(scan_of(room(step)).repeated, 0U) << step;
	// A fence: every sixth beam meets a pole, and the laser rounds to 5 cm.
	auto fence = room(0.05F);
	for (std::size_t i = 0; i < fence.size(); i += 6) fence[i] = 0.05F * std::round(fence[i] / 2 / 0.05F);
	EXPECT_EQ(scan_of(fence).repeated, 0U);
	// A round room, and an object that hides a third of it.
	EXPECT_EQ(scan_of(std::vector<float>(180, 4.0F)).repeated, 0U);
	auto hidden = room(0.01F);
	std::fill(hidden.begin() + 20, hidden.begin() + 80, 0.8F);
	EXPECT_EQ(scan_of(hidden).repeated, 0U);
}

TEST(ScanReadings, NoReturnsInGapsOfSurfacesAreLostBeams)
{
	for (const double share : {0.2, 0.4, 0.5})
		for (const unsigned seed : {1U, 2U, 3U})
		{
			const Scan scan = scan_of(spoiled(room(), share, HUGE_VALF, seed));
			EXPECT_GT(scan.lost, 20U) << share;
			EXPECT_TRUE(std::all_of(scan.beams.begin(), scan.beams.end(), [](const Beam& b) { return b.is_return; }));
			EXPECT_EQ(scan_of(spoiled(room(), share, HUGE_VALF, seed), 1).lost, 0U) << "the user says: always data";
		}
	auto open = room();
	for (float& range : open)
		if (range > 2.6F) range = HUGE_VALF;  // nothing is there but at the sides
	EXPECT_EQ(scan_of(open).lost, 0U);
	EXPECT_GT(scan_of(open, 0).lost, 40U) << "the user says: never data";
	auto doors = room();
	for (std::size_t i = 0; i < 180; i += 45)
		std::fill_n(doors.begin() + static_cast<std::ptrdiff_t>(i), 12, HUGE_VALF);
	EXPECT_EQ(scan_of(doors).lost, 0U) << "gaps of 12 deg";
}
}  // namespace d2s1r::test
